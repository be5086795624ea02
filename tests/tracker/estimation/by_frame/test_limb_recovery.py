import itertools
from dataclasses import replace

import numpy as np
import pytest
from staging import SUIT, cameras_around, dressed, own_evidence, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.compute.sampling import even_points
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.by_frame import limb_recovery
from tracker.estimation.by_frame.limb_recovery import search_limbs
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import RecoverSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.formats.model_toml import load_model


def limb_of(model, name):
    return next(x for x in limbs(model) if x.name == name)


def turned(model, values, **degrees):
    """A pose with some angles set, deg; `left_elbow__extension=90`."""
    out = np.array(values)
    for name, angle in degrees.items():
        out[model.dof_value[model.dof_names.index(name.replace("__", "."))]] = np.radians(angle)
    return model.clip(out)


class Staged:
    """A frame that shows a body in its clothes, and the body in another pose before it."""

    def __init__(self, model, truth, wrong, colors=True):
        bodies = [PosedBody(model, truth)]
        views = dressed(bodies, cameras_around(4), SUIT)
        self.model, self.truth = model, truth
        match = ContourResiduals(views, [PosedBody(model, wrong)])
        priors = [PosePrior(wrong, np.full(model.n_dofs, 1.0))]
        known = Colors(views, bodies).learn() if colors else None
        self.scorer = PoseScorer.of(match, priors, Colors(views, [PosedBody(model, wrong)]), known, RecoverSettings())
        self.blocks = [match, *priors]
        # As a tracker would bring it: refined from there, which does not lead out.
        self.here = self.scorer.scored(model, solve(model, wrong, self.blocks, max_iterations=15, tolerance=1e-3))

    def search(self, limb, others=()):
        return self.searched(limb, others)[0]

    def searched(self, limb, others=()):
        return search_limbs(self.model, [limb], self.here, others, self.scorer)

    def off_m(self, found, parts):
        """Largest distance of the points of some parts from the truth, metres."""
        points = np.isin(self.model.point_parts, parts)
        true = self.model.points_world(self.truth)
        return np.linalg.norm(found.body.points_world - true, axis=1)[points].max()


LOST = {
    "inside the trunk": {
        "left_shoulder__abduction": -5,
        "left_shoulder__elevation": 0,
        "left_shoulder__twist": -90,
        "left_elbow__extension": 120,
    },
    "60 degrees off": {"left_shoulder__abduction": 110},
    "at the side": {"left_shoulder__abduction": 0, "left_shoulder__elevation": 0, "left_elbow__extension": 0},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "colors", "least"), [("gavrila22", True, 7), ("gavrila22", False, 7), ("gavrila34", True, 8)]
)
def test_lost_arms_are_found(name, colors, least):
    """Nine lost arms: nearly all are found; whatever is done costs less than before."""
    model = load_model(name)
    arm, n_found = limb_of(model, "left_forearm"), 0
    for seed, lost in itertools.product((1, 2, 3), LOST.values()):
        truth = posed(model, seed)
        staged = Staged(model, truth, turned(model, truth, **lost), colors)
        assert staged.off_m(staged.here, arm.parts) > 0.15
        result = staged.search(arm)
        assert result is staged.here or result.cost < staged.here.cost
        np.testing.assert_allclose(model.clip(result.pose), result.pose, atol=1e-9)
        # The others are where they were, which is where they belong.
        for other in limbs(model):
            if other.name not in (arm.name, "head"):
                assert staged.off_m(result, other.parts) < 0.025, other.name
        n_found += staged.off_m(result, arm.parts) < 0.03
    assert n_found >= least


def test_a_lost_leg_is_found(gavrila):
    truth = posed(gavrila, 2)
    wrong = turned(gavrila, truth, left_hip__elevation=-20, left_knee__extension=0)
    staged, leg = Staged(gavrila, truth, wrong), limb_of(gavrila, "left_calf")
    assert staged.off_m(staged.here, leg.parts) > 0.15
    assert staged.off_m(staged.search(leg), leg.parts) < 0.03


@pytest.mark.slow
def test_limbs_that_are_lost_together(gavrila):
    """An arm on a leg that went elsewhere: neither finds its place while the other is in the way."""
    n_found = 0
    for seed in (1, 2, 3):
        truth = posed(gavrila, seed)
        wrong = turned(gavrila, truth, **LOST["inside the trunk"], left_hip__elevation=-20, left_knee__extension=0)
        staged = Staged(gavrila, truth, wrong)
        suspects = [limb_of(gavrila, n) for n in ("left_forearm", "left_calf")]
        assert all(staged.off_m(staged.here, x.parts) > 0.15 for x in suspects)
        found = search_limbs(gavrila, suspects, staged.here, (), staged.scorer)[0]
        n_found += all(staged.off_m(found, x.parts) < 0.03 for x in suspects)
    assert n_found >= 2


def test_places_are_looked_for_once_for_each_limb(gavrila, monkeypatch):
    """However many poses the first limb leaves."""
    truth, looked = posed(gavrila, 1), []
    staged = Staged(gavrila, truth, turned(gavrila, truth, **LOST["60 degrees off"]))
    candidates = limb_recovery._candidates
    monkeypatch.setattr(limb_recovery, "_candidates", lambda *a: looked.append(a) or candidates(*a))
    monkeypatch.setattr(limb_recovery, "BEAM_NATS", 1e6)
    suspects = [limb_of(gavrila, n) for n in ("left_forearm", "left_calf")]
    found = search_limbs(gavrila, suspects, staged.here, (), staged.scorer)[0]
    assert staged.off_m(found, suspects[0].parts) < 0.03
    assert len(looked) == 2


@pytest.mark.slow
def test_the_whole_body_is_refined_only_with_poses_near_the_best(gavrila, monkeypatch):
    truth, n_refined = posed(gavrila, 1), []
    staged = Staged(gavrila, truth, turned(gavrila, truth, **LOST["60 degrees off"]))
    each = PoseScorer.each
    monkeypatch.setattr(
        PoseScorer, "each", lambda self, work, poses: n_refined.append(len(poses)) or each(self, work, poses)
    )
    arm = limb_of(gavrila, "left_forearm")
    for beam, is_refined in ((40.0, True), (-np.inf, False)):
        n_refined.clear()
        monkeypatch.setattr(limb_recovery, "BEAM_NATS", beam)
        found = limb_recovery._search_limb(gavrila, arm, [], [staged.here], (), staged.scorer)
        assert [n > 0 for n in n_refined] == [True, is_refined]
        assert bool(found) is is_refined


def test_best_places_apart(gavrila):
    """One good place does not take all the room: the best pose of each place is there, best first."""
    arm, base = limb_of(gavrila, "left_forearm"), gavrila.neutral()
    there = turned(gavrila, base, left_shoulder__abduction=90)
    rng = np.random.default_rng(0)
    near = [turned(gavrila, base, left_elbow__extension=a) for a in rng.uniform(0, 3, 20)]
    poses, scores = np.array([*near, there]), np.array([*rng.uniform(1, 2, 20), 0.5])
    found = limb_recovery._best_apart(gavrila, arm, poses, scores, 5)
    np.testing.assert_array_equal(found, [poses[np.argmax(scores)], there])
    np.testing.assert_array_equal(limb_recovery._best_apart(gavrila, arm, poses, scores, 1), found[:1])
    # Where another limb is does not count.
    legs = np.array([base, turned(gavrila, base, left_knee__extension=90)])
    assert len(limb_recovery._best_apart(gavrila, arm, legs, np.zeros(2), 5)) == 1


@pytest.mark.slow
def test_a_pose_without_better_ones_is_kept(gavrila):
    truth = posed(gavrila, 1)
    staged = Staged(gavrila, truth, truth)
    staged.here = staged.scorer.scored(gavrila, solve(gavrila, truth, staged.blocks, max_iterations=60, tolerance=1e-7))
    for limb in limbs(gavrila):
        assert staged.search(limb) is staged.here


def both_shown(one, other):
    """Evidence that shows two figures where there is one person, all of one colour: the edges of both."""
    return [
        replace(
            a,
            points_px=np.concatenate([a.points_px, b.points_px]),
            normals=np.concatenate([a.normals, b.normals]),
            distance=np.minimum(a.distance, b.distance),
            colors=np.zeros((a.camera.height, a.camera.width, 3), np.uint8),
        )
        for a, b in zip(one, other, strict=True)
    ]


def test_two_places_that_are_about_as_good_are_both_told(gavrila):
    """The edges show the arm twice, and no colours tell which is meant: the other place is kept."""
    here, there = (turned(gavrila, posed(gavrila, 1), left_shoulder__abduction=a) for a in (80, 120))
    arm, cameras = limb_of(gavrila, "left_forearm"), cameras_around(4)
    views = both_shown(*(own_evidence([PosedBody(gavrila, v)], cameras) for v in (here, there)))
    body = [PosedBody(gavrila, here)]
    scorer = PoseScorer.of(
        ContourResiduals(views, body, everywhere=True), [], Colors(views, body), None, RecoverSettings()
    )
    fit = solve(gavrila, here, [scorer.residuals], max_iterations=15, tolerance=1e-3)
    best, *others = search_limbs(gavrila, [arm], scorer.scored(gavrila, fit), (), scorer)
    wrist = gavrila.point_names.index("left_wrist")
    ends = np.array([h.body.points_world[wrist] for h in (best, *others)])
    wanted = np.array([gavrila.points_world(v)[wrist] for v in (here, there)])
    assert np.linalg.norm(ends[:, None] - wanted, axis=-1).min(axis=0).max() < 0.05  # both are there
    assert all(h.cost < best.cost + CLEAR_NATS for h in others)
    # Where the edges show it once there is nothing to choose from.
    once = Staged(gavrila, here, turned(gavrila, here, **LOST["inside the trunk"]))
    assert len(once.searched(arm)) == 1


def test_the_same_every_time(gavrila):
    truth = posed(gavrila, 1)
    wrong = turned(gavrila, truth, **LOST["60 degrees off"])
    twice = []
    for _ in range(2):
        even_points.cache_clear()  # as in another run of the program
        twice.append(Staged(gavrila, truth, wrong).search(limb_of(gavrila, "left_forearm")))
    np.testing.assert_array_equal(twice[0].pose, twice[1].pose)
    assert twice[0].cost == twice[1].cost


@pytest.mark.slow
@pytest.mark.parametrize("threads", [2, 5, 60])
def test_the_same_however_many_threads_look(gavrila, monkeypatch, threads):
    """Also where there are more threads than poses."""
    truth = posed(gavrila, 1)
    wrong = turned(gavrila, truth, **LOST["60 degrees off"])
    limb, usual = limb_of(gavrila, "left_forearm"), Staged(gavrila, truth, wrong).scorer

    def candidates(n):
        monkeypatch.setattr(limb_recovery, "N_HELPERS", n)
        with_threads = PoseScorer.of(usual.residuals, usual.priors, usual.colors, usual.part_colors, usual.settings)
        return limb_recovery._candidates(gavrila, limb, [], wrong, [], with_threads.restricted_to(limb))

    np.testing.assert_array_equal(candidates(threads), candidates(1))


def test_other_poses_are_tried_as_they_are(gavrila):
    """No proposal lies near enough, but the frame before had the arm where it belongs, and the legs elsewhere."""
    truth = posed(gavrila, 1)
    arm = limb_of(gavrila, "left_forearm")
    staged = Staged(gavrila, truth, turned(gavrila, truth, **LOST["inside the trunk"]))
    few = RecoverSettings(proposals=2, reach_rad=1e-3, n_local_search=2, perturbations_rad=(1e-3,))
    staged.scorer = replace(staged.scorer, settings=few)
    assert staged.search(arm, [staged.here.pose]) is staged.here
    before = turned(gavrila, truth, left_knee__extension=100, right_hip__elevation=60)
    result = staged.search(arm, [before])
    assert staged.off_m(result, arm.parts) < 0.03
    assert staged.off_m(result, np.arange(len(gavrila.parts))) < 0.03


def test_colours_tell_limbs_apart_that_edges_do_not(gavrila):
    """The scorer prefers the pose whose parts are under their own colours; without them it goes by the cost alone."""
    truth = posed(gavrila, 1)
    with_colors, without = (Staged(gavrila, truth, truth, c) for c in (True, False))
    crossed = solve(gavrila, turned(gavrila, truth, **LOST["60 degrees off"]), without.blocks, max_iterations=0)
    for staged in (with_colors, without):
        there, here = (staged.scorer.cost(fit) - fit.cost for fit in (crossed, staged.here.fit))
        assert (there > here) if staged is with_colors else (there == here == 0)
    candidates = np.array([staged.here.pose, crossed.pose])
    np.testing.assert_allclose(
        with_colors.scorer.costs(candidates) - without.scorer.costs(candidates),
        [-0.2 * with_colors.scorer.colors.score(v, with_colors.scorer.part_colors).nats for v in candidates],
    )
