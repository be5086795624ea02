"""The score of a limb against a plain version that tests each sample of each pose against all parts."""

import numpy as np
import pytest
from staging import SUIT, at, camera_at, cameras_around, dressed, posed, solid

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.part_colors import Colors

BINS, SAMPLES = 12, 7


def middle_depths(eye, ray, bodies):
    """For each part of each body, how many rays long the way is to the middle of the chord it shares with a ray."""
    out = []
    for body in bodies:
        model = body.model
        Ts = model.kinematics(body.values).Ts_world_part
        for T, center, shape in zip(Ts, model.centers_part, model.shapes, strict=True):
            half = np.array(shape.half_axes)
            o = (T[:3, :3].T @ (eye - T[:3, 3]) - center) / half
            d = T[:3, :3].T @ ray / half
            A, B, C = d @ d, o @ d, o @ o - 1
            out.append(-B / A if B < 0 and B * B > A * C else np.inf)
    return np.array(out)


def plain_samples(views, bodies, person, values, limb, away=()):
    """Of each sample of a limb: its view and part, whether it is hidden, the part behind it, the pixels across it."""
    model = bodies[person].model
    bodies = [PosedBody(model, values) if i == person else b for i, b in enumerate(bodies)]
    first = sum(len(b.model.parts) for b in bodies[:person])
    Ts = model.kinematics(values).Ts_world_part
    for view in views:
        eye, P = view.camera.center_world, view.camera.projection
        for part in limb:
            T, center, half = Ts[part], model.centers_part[part], model.shapes[part].half_axes
            for share in np.linspace(-0.8, 0.8, SAMPLES):
                X = T[:3, :3] @ (center + np.array([0, 0, share * half[2]])) + T[:3, 3]
                depths = middle_depths(eye, X - eye, bodies)
                depths[[first + part, *(first + p for p in away)]] = np.inf
                side = np.cross(T[:3, 2], X - eye)
                side /= np.linalg.norm(side)
                across = [P @ [*(X + 0.5 * s * half[0] * side), 1] for s in range(-2, 3)]
                pixels = [np.floor(h[:2] / h[2] + 0.5).astype(int) for h in across]
                without = depths.copy()
                without[[first + p for p in limb]] = np.inf
                own = slice(first, first + len(model.parts))
                behind = without.argmin() - first if without.min() < np.inf else -1
                yield view, part, depths.min() < 1, behind if behind in range(own.stop - first) else -1, pixels


def plain_look(views, bodies, person, values, limb, ratios, away=()):
    """Score of one pose by the definition of `LimbScorer`."""
    nats = 0.0
    for view, part, hidden, behind, pixels in plain_samples(views, bodies, person, values, limb, away):
        for i, (u, v) in enumerate(pixels):
            if hidden:
                continue
            if not (0 <= u < view.camera.width and 0 <= v < view.camera.height):
                nats -= 0.25
            elif i in (0, 4):
                nats += 1.5 * (0.3 - min(view.distance[v, u] / view.theta_px, 1))
            else:
                r, g, b = (view.colors[v, u].astype(int) * BINS) // 256
                color = (r * BINS + g) * BINS + b
                nats += ratios[part, color] - (ratios[behind, color] if behind >= 0 else 0)
    return nats


@pytest.fixture(scope="module")
def couple(gavrila):
    """Two figures close together, of which the second is scored, and views of them in their clothes."""
    bodies = [PosedBody(gavrila, gavrila.retract(posed(gavrila, s), np.pad(move, (0, gavrila.n_dofs - 3))))
              for s, move in ((1, [0.3, 0.1, 0.0]), (2, [-0.1, -0.1, 0.0]))]  # fmt: skip
    views = dressed(bodies, cameras_around(3), SUIT)
    return views, bodies, Colors(views, bodies, 1).learn()


def moved(model, values, limb, n, seed=0):
    """Poses with the limb anywhere near."""
    steps = np.random.default_rng(seed).normal(0, 0.6, (n, model.n_dofs)) * limb.dofs
    return model.clip(model.retract(values, steps))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["left_forearm", "right_calf"])
def test_a_look_is_what_its_definition_says(gavrila, couple, name):
    """All but a few samples at the border of an occluder, where the cells of the image are coarser."""
    views, bodies, known = couple
    limb = next(x for x in limbs(gavrila) if x.name == name)
    poses = moved(gavrila, bodies[1].values, limb, 25)
    away = [p for x in limbs(gavrila) if x.name == name.replace("left", "?").replace("right", "left") for p in x.parts]
    for gone in ([], away):
        found = Colors(views, bodies, 1).limb_scorer(bodies[1].values, limb.parts, known, gone)(poses)
        wanted = [plain_look(views, bodies, 1, v, limb.parts, known.log_ratios, gone) for v in poses]
        assert np.std(wanted) > 20
        assert np.median(np.abs(found - wanted)) < 2
        assert np.corrcoef(found, wanted)[0, 1] > 0.995
        assert np.argmax(found) == np.argmax(wanted)


def test_a_limb_in_the_open(gavrila, couple):
    """A free arm, not occluded: the same but for a pixel. Without learnt colours only edges count."""
    views, _, known = couple
    pose = np.array(gavrila.neutral())
    pose[gavrila.dof_names.index("left_shoulder.abduction")] = np.pi / 2
    bodies = [PosedBody(gavrila, pose)]
    arm = np.array([gavrila.part_index[n] for n in ("left_upper_arm", "left_forearm")])
    for ratios in (None, known):
        found = Colors(views, bodies).limb_scorer(pose, arm, ratios)(pose[None])
        table = np.zeros_like(known.log_ratios) if ratios is None else ratios.log_ratios
        assert found[0] == pytest.approx(plain_look(views, bodies, 0, pose, arm, table), abs=0.5)


@pytest.mark.parametrize("way", [1, -1])
def test_an_occluder_beside_the_image_is_known(way):
    """A ball behind a wall scores 0, also outside the image; beside the wall it scores slightly negative there."""
    ball, wall = solid((0.1, 0.1, 0.2)), solid((0.1, 0.4, 1.0))
    camera = camera_at("front", (4.0, 0.0, 0.0))
    # 320 px of 520 px at 3 m are 1.85 m: the wall begins beyond them.
    bodies = [at(ball, 0, 0, 0), at(wall, 1.0, 2.3 * way, 0)]
    colors = Colors(dressed(bodies, [camera], {"solid": (200, 0, 0)}), bodies)
    part = np.array([0])
    hidden, beside = (at(ball, 0, y, 0).values for y in (3.1 * way, -3.1 * way))
    assert colors.limb_scorer(hidden, part, None)(hidden[None]) == 0
    assert colors.limb_scorer(beside, part, None)(beside[None]) == pytest.approx(-0.25 * 5 * SAMPLES)


@pytest.mark.parametrize("distance", [0.05, 0.3, 0.9])
def test_a_limb_and_others_that_reach_the_cameras_plane(gavrila, distance):
    """Such parts have no bounded image; the score of the visible samples is still that of the definition."""
    stand = gavrila.neutral()
    bodies = [PosedBody(gavrila, stand)]
    arm = next(x for x in limbs(gavrila) if x.name == "left_forearm")
    place = gavrila.points_world(stand)[gavrila.point_names.index("left_shoulder")]
    camera = camera_at("near", place + np.array([distance, 0.1, 0.3]), place)
    views = dressed(bodies, [camera_at("far", (4, 0, 0.5))], SUIT)
    colors = Colors(views, bodies)
    known = colors.learn()
    near = dressed(
        [at(solid((0.2, 0.2, 0.2)), *(place - np.array([2.0, 0.0, 0.0])))], [camera], {"solid": SUIT["forearm"]}
    )
    poses = moved(gavrila, stand, arm, 20, 1)
    found = Colors(near, bodies).limb_scorer(stand, arm.parts, known)(poses)
    assert np.isfinite(found).all()
    for pose, nats in zip(poses, found, strict=True):
        P = camera.projection
        T = gavrila.kinematics(pose).Ts_world_part[arm.parts]
        if (P[2, :3] @ T[:, :3, 3].T + P[2, 3] > 0.4).all():
            assert nats == pytest.approx(plain_look(near, bodies, 0, pose, arm.parts, known.log_ratios), abs=15)
