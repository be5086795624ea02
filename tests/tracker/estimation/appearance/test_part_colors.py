from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from staging import SUIT, at, camera_at, cameras_around, dressed, own_evidence, posed, shaken, solid

from tracker.body.model import PosedBody
from tracker.estimation.appearance import part_colors
from tracker.estimation.appearance.part_colors import Colors
from tracker.evidence.images.color_histogram import BINS

GRAY = dict.fromkeys(SUIT, (120, 120, 120))
CAMERAS = cameras_around()


def colors_of(model, values, suit=SUIT, cameras=CAMERAS):
    bodies = [PosedBody(model, values)]
    return Colors(dressed(bodies, cameras, suit), bodies)


def parts(model, *names):
    return [model.part_index[n] for n in names]


@pytest.fixture(scope="module")
def stand(gavrila):
    return posed(gavrila, 1)


@pytest.fixture(scope="module")
def seen(gavrila, stand):
    """The colours of an upright figure, and the colours learnt from them."""
    found = colors_of(gavrila, stand)
    return found, found.learn()


def test_the_pose_it_was_learnt_in_scores_best(gavrila, stand, seen):
    colors, known = seen
    rng = np.random.default_rng(0)
    best = colors.score(stand, known)
    poses = np.array([stand, *(shaken(gavrila, stand, rng, 0.25, 0.08) for _ in range(30))])
    others = [colors.score(v, known).nats for v in poses[1:]]
    np.testing.assert_allclose(colors.nats(poses, known), [best.nats, *others], rtol=1e-9)
    assert best.nats > 0
    assert best.nats > max(others)
    assert best.nats / best.samples.sum() > 1  # each sample is three times as likely on its part as elsewhere


def test_arms_for_legs_score_worse(gavrila, stand, seen):
    """Head over heels about its middle, the arms where the legs were: the outline is much the same."""
    colors, known = seen
    turned = np.array(stand)
    turned[gavrila.dof_names.index("torso.abduction")] += np.pi
    right, wrong = (colors.score(v, known) for v in (stand, turned))
    assert wrong.nats < 0 < right.nats
    limbs = parts(gavrila, "left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh", "left_calf", "right_calf")
    assert (wrong.parts[limbs] < right.parts[limbs] - 0.5).all()


def test_other_clothes_score_worse(gavrila, stand, seen):
    """Sleeves and trousers with exchanged colours: each of these parts scores worse, and no other."""
    colors, known = seen
    swapped = SUIT | {"upper_arm": SUIT["thigh"], "thigh": SUIT["upper_arm"]}
    changed = colors_of(gavrila, stand, swapped).score(stand, known).parts - colors.score(stand, known).parts
    swapped_parts = parts(gavrila, "left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh")
    assert (changed[swapped_parts] < -1).all()
    np.testing.assert_allclose(np.delete(changed, swapped_parts), 0, atol=0.2)


def test_one_colour_everywhere_gives_no_evidence(gavrila, stand):
    bodies = [PosedBody(gavrila, stand)]
    views = [replace(v, colors=np.full((480, 640, 3), 120, np.uint8)) for v in dressed(bodies, CAMERAS, GRAY)]
    colors = Colors(views, bodies)
    known = colors.learn()
    rng = np.random.default_rng(1)
    for values in (stand, shaken(gavrila, stand, rng, 0.3, 0.1)):
        found = colors.score(values, known)
        assert found.nats == pytest.approx(0, abs=1e-3)
        np.testing.assert_allclose(found.parts, 0, atol=1e-5)
        assert found.samples.sum() > 300


def test_a_body_of_one_colour_tells_itself_from_the_rest_alone(gavrila, stand):
    colors = colors_of(gavrila, stand, GRAY)
    known = colors.learn()
    beside = gavrila.retract(stand, np.pad([0.0, 0.0, 5.0], (0, gavrila.n_dofs - 3)))
    assert colors.score(stand, known).nats > 0
    off = gavrila.retract(stand, np.pad([0.3, -0.3], (0, gavrila.n_dofs - 2)))
    assert colors.score(off, known).nats < 0
    assert colors.score(beside, known).samples.sum() == 0  # above all images
    # One part is like another.
    np.testing.assert_allclose(known.log_ratios.max(axis=1), known.log_ratios.max(), rtol=0.01)


def test_samples_in_the_open_and_behind_others():
    ball, wall = solid((0.2, 0.2, 0.3)), solid((0.1, 1.0, 1.0))
    front, back = camera_at("front", (4.0, 0.0, 0.0)), camera_at("back", (-4.0, 0.0, 0.0))
    alone, behind = [at(ball, 0, 0, 0)], [at(ball, 0, 0, 0), at(wall, 1.5, 0, 0)]

    def samples(bodies, cameras):
        colors = Colors(dressed(bodies, cameras, {"solid": (200, 0, 0)}), bodies)
        return int(colors.score(bodies[0].values, colors.learn()).samples.sum())

    assert samples(alone, [front]) == samples(alone, [back]) > 10
    assert samples(alone, [front, back]) == 2 * samples(alone, [front])
    assert samples(behind, [front]) == 0
    assert samples(behind, [back]) == samples(alone, [back])
    # The one that is looked at may be any in the list, and elsewhere.
    colors = Colors(dressed(behind, [front], {"solid": (200, 0, 0)}), behind, person=1)
    known = colors.learn()
    assert colors.score(behind[1].values, known).samples.sum() > 10
    # Beside the images nothing is seen: 320 px of 520 px at 4 m are 2.46 m.
    for way in (-2.8, 2.8):
        assert colors.score(at(wall, 0, 1.5 * way, 0).values, known).samples.sum() == 0
        assert samples([at(ball, 0, way, 0)], [front]) == 0


def test_parts_hidden_by_the_body_give_no_samples(gavrila):
    """From the left the trunk occludes the hanging right arm."""
    stand = gavrila.neutral()
    left, right = (camera_at(n, (0.0, y, 0.2)) for n, y in (("left", 4.0), ("right", -4.0)))
    arms = parts(gavrila, "left_upper_arm", "right_upper_arm")
    for camera, expected in ((left, [True, False]), (right, [False, True])):
        colors = colors_of(gavrila, stand, cameras=[camera])
        assert (colors.score(stand, colors.learn()).samples[arms] > 0).tolist() == expected


def test_left_and_right_share(gavrila):
    """The colours of one arm are used for the other one while it is unseen; later each has its own."""
    stand, names = gavrila.neutral(), gavrila.part_index
    cameras = [camera_at("left", (0.0, 4.0, 0.2)), camera_at("right", (0.0, -4.0, 0.2))]
    arms = parts(gavrila, "left_upper_arm", "right_upper_arm")
    for seen_from, later_from in ((0, 1), (1, 0)):
        known = colors_of(gavrila, stand, cameras=[cameras[seen_from]]).learn()
        for name in (n for n in names if n.startswith("left_")):
            twin = names[name.replace("left_", "right_")]
            np.testing.assert_array_equal(known.log_ratios[names[name]], known.log_ratios[twin])
        later = colors_of(gavrila, stand, cameras=[cameras[later_from]]).score(stand, known)
        assert later.samples[arms[later_from]] > 10
        assert later.parts[arms[later_from]] > 1
        assert later.parts[arms[seen_from]] == 0  # hidden
    # Different kinds of parts do not share.
    assert np.abs(known.log_ratios[names["left_thigh"]] - known.log_ratios[names["left_calf"]]).max() > 1


def test_views_without_colours_are_passed_over(gavrila, stand):
    bodies = [PosedBody(gavrila, stand)]
    views = dressed(bodies, CAMERAS, SUIT)
    blind = replace(views[0], colors=None)
    two, three = Colors(views[1:], bodies), Colors([blind, *views[1:]], bodies)
    known = two.learn()
    np.testing.assert_array_equal(three.learn().log_ratios, known.log_ratios)
    assert two.score(stand, known).nats == three.score(stand, known).nats
    none = Colors([blind], bodies)
    assert none.score(stand, none.learn()).nats == 0
    assert not none.score(stand, known).samples.any()


def darker(views, share=0.6):
    return [replace(v, colors=(v.colors * share).astype(np.uint8)) for v in views]


@pytest.mark.slow
def test_colours_follow_the_light(gavrila, stand, seen):
    """The light fades step by step: colours learnt along the way still match, colours learnt once do not."""
    colors, first = seen
    bodies = [PosedBody(gavrila, stand)]
    views, known = dressed(bodies, CAMERAS, SUIT), first
    for share in np.linspace(1.0, 0.6, 25):
        known = Colors(darker(views, share), bodies).learn(known, 0.3)
    late = Colors(darker(views), bodies)
    assert late.score(stand, known).nats > 0.7 * colors.score(stand, first).nats
    assert late.score(stand, first).nats < 0.5 * colors.score(stand, first).nats


def test_a_part_that_is_not_there_is_not_learnt(gavrila, stand, seen):
    """Both arms beside the arms of the image lie on the wall: the learnt colours of arms stay."""
    colors, first = seen
    wrong = np.array(stand)
    for side in ("left", "right"):
        wrong[gavrila.dof_names.index(f"{side}_shoulder.abduction")] += 1.0
    views, known = dressed([PosedBody(gavrila, stand)], CAMERAS, SUIT), first
    for _ in range(20):
        known = Colors(views, [PosedBody(gavrila, wrong)]).learn(known, 0.3)
    arm = gavrila.part_index["left_forearm"]
    right = Colors(views, [PosedBody(gavrila, stand)])
    assert right.score(stand, known).parts[arm] > 0.9 * colors.score(stand, first).parts[arm]


def test_a_look_tells_where_a_limb_is(gavrila, stand):
    """The score is highest at the limb. Before the trunk the limb shows what would be visible without it, which is no
    evidence."""
    colors = colors_of(gavrila, stand, SUIT | dict.fromkeys(("upper_arm", "forearm", "torso"), (200, 40, 40)))
    arm, known = np.array(parts(gavrila, "left_upper_arm", "left_forearm")), colors.learn()
    before_trunk = np.array(stand)
    for name, angle in (("shoulder.abduction", 0.0), ("shoulder.elevation", 0.6), ("shoulder.twist", -1.4)):
        before_trunk[gavrila.dof_names.index(f"left_{name}")] = angle
    before_trunk[gavrila.dof_names.index("left_elbow.extension")] = 1.8
    rng = np.random.default_rng(2)
    others = [shaken(gavrila, stand, rng, 0.5, 0.0) for _ in range(20)]
    found = colors.limb_scorer(stand, arm, known)(np.array([stand, before_trunk, *others]))
    assert found.argmax() == 0
    assert found[1] < 0


def test_a_limb_that_is_away_hides_nothing(gavrila):
    """The right arm and the trunk occlude the left arm; without them the left arm has a score."""
    stand = gavrila.neutral()
    bodies = [PosedBody(gavrila, stand)]
    view = dressed(bodies, [camera_at("right", (0.0, -4.0, 0.2))], SUIT)
    colors = Colors(view, bodies)
    arm, twin = (np.array(parts(gavrila, f"{s}_upper_arm", f"{s}_forearm")) for s in ("left", "right"))
    trunk = parts(gavrila, "torso", "head")
    known = colors.learn()
    hidden, open_ = (colors.limb_scorer(stand, arm, known, x)(stand[None]) for x in ([], [*twin, *trunk]))
    assert hidden[0] == 0
    assert open_[0] != 0


def test_pixels_are_counted_by_their_colour():
    image = np.random.default_rng(3).integers(0, 256, (37, 53, 3), dtype=np.uint8)
    image[:5] = 255
    steps = image.reshape(-1, 3).astype(int) * BINS // 256
    each = (steps[:, 0] * BINS + steps[:, 1]) * BINS + steps[:, 2]
    (view,) = own_evidence([at(solid((0.2, 0.2, 0.2)), 0.0, 0.0, 0.0)], CAMERAS[:1])
    np.testing.assert_array_equal(replace(view, colors=image).color_counts, np.bincount(each, minlength=BINS**3))
    assert not replace(view, colors=None).color_counts.any()


def test_colours_of_many_parts_are_smoothed_each_by_itself():
    counts = np.random.default_rng(4).random((3, BINS**3))
    for one, smooth in zip(counts, part_colors.smoothed(counts), strict=True):
        cube = gaussian_filter(one.reshape(BINS, BINS, BINS), 0.7, mode="nearest")
        np.testing.assert_allclose(smooth, cube.ravel(), rtol=1e-12)
