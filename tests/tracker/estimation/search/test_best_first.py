import numpy as np
import pytest
from staging import at, cameras_around, own_evidence, shaken, solid

from tracker.body.model import PosedBody
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE, ContourResiduals
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.search.best_first import COARSE_SEARCH, SearchSettings, search, stages
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.formats.model_toml import load_model

COARSE = SearchSettings(passes=(1.0,))


class Counted:
    """A cost that counts the poses it scores."""

    def __init__(self, cost):
        self.cost, self.models, self.asked = cost, cost.models, 0

    def __call__(self, poses):
        self.asked += 1
        return self.cost(poses)

    def of_person(self, person, candidates, poses):
        self.asked += len(candidates)
        return self.cost.of_person(person, candidates, poses)


def displaced(model, values, **steps):
    """A pose with some degrees of freedom changed; names with __ for the dot."""
    change = np.zeros(model.n_dofs)
    for name, step in steps.items():
        change[model.dof_names.index(name.replace("__", "."))] = step
    return model.retract(values, change)


@pytest.fixture(scope="module")
def truth(gavrila):
    """A pose away from all limits, so that steps either way are allowed."""
    return displaced(
        gavrila, gavrila.neutral(), torso__twist=0.3,
        left_shoulder__abduction=0.6, right_shoulder__abduction=0.5, left_elbow__extension=0.6,
        right_elbow__extension=0.7, left_hip__abduction=0.2, right_hip__abduction=0.2, left_knee__extension=0.5,
        right_knee__extension=0.4,
    )  # fmt: skip


@pytest.fixture(scope="module")
def views(gavrila, truth):
    return own_evidence([PosedBody(gavrila, truth)], cameras_around())


@pytest.fixture(scope="module")
def start(gavrila, truth):
    return shaken(gavrila, truth, np.random.default_rng(5), np.radians(5), 0.03)


@pytest.fixture(scope="module")
def steps(gavrila, views, start):
    """Every step of a whole search with the default settings."""
    return list(search(ChamferCost(views, [PosedBody(gavrila, start)]), [start]))


def test_the_search_goes_stage_by_stage(gavrila, steps):
    order = [s.stage for i, s in enumerate(steps) if i == 0 or s.stage is not steps[i - 1].stage]
    names = ["torso and head", "arms", "legs"]
    assert [(s.factor, s.group.name) for s in order] == [(f, n) for f in (1.0, 0.5, 0.25) for n in names]
    assert [s.name for s in order[2:4]] == ["legs", "torso and head, steps x 0.5"]
    ends = [i for i, s in enumerate(steps) if s.stage_done]
    assert [steps[i].stage for i in ends] == order
    # GD96 Sect. 4.1: 5 degrees of freedom of the torso, 9 of the arms with the torso's twist, 8 of the legs.
    assert [len(s.group.dofs) for s in order[:3]] == [5, 9, 8]


def test_the_best_never_gets_worse(gavrila, views, start, steps):
    cost = ChamferCost(views, [PosedBody(gavrila, start)])
    before = cost([start]).total_px
    for step in steps:
        assert step.best_px <= before
        assert step.candidate_px >= step.best_px
        before = step.best_px
    assert steps[-1].best_px < 0.5 * cost([start]).total_px


def test_a_step_tells_the_truth(gavrila, views, start, steps):
    """A search stopped anywhere leaves poses that cost what its last step states."""
    cost = ChamferCost(views, [PosedBody(gavrila, start)])
    for step in steps[::7]:
        assert cost(step.best).total_px == pytest.approx(step.best_px, rel=1e-9)
        assert cost(step.candidate).total_px == pytest.approx(step.candidate_px, rel=1e-9)


def test_stopping_early_changes_nothing_of_what_was_found(gavrila, views, start, steps):
    running = search(ChamferCost(views, [PosedBody(gavrila, start)]), [start])
    for expected in steps[:10]:
        step = next(running)
        assert step.best_px == expected.best_px
        np.testing.assert_array_equal(step.best[0], expected.best[0])
    running.close()


def test_only_the_stages_own_dofs_move_and_within_bounds(gavrila, start, steps):
    before = start
    for step in steps:
        change = gavrila.difference(step.candidate[0], before)
        own = [gavrila.dof_names.index(n) for n in step.stage.group.dofs]
        others = np.setdiff1d(np.arange(gavrila.n_dofs), own)
        np.testing.assert_allclose(change[others], 0, atol=1e-12)
        bounds = np.where(gavrila.dof_is_length, 0.10, np.radians(15)) + 1e-9
        assert np.all(np.abs(gavrila.difference(step.candidate[0], start)) <= bounds)
        np.testing.assert_allclose(gavrila.clip(step.candidate[0]), step.candidate[0], atol=1e-12)
        before = step.best[0]


def test_limits_hold(gavrila, views, truth):
    """Elbows and knees are straight: lattice nodes beyond their limits are clipped."""
    straight = np.where([n.endswith("extension") for n in gavrila.value_names], 0.02, truth)
    seen = set()
    for step in search(ChamferCost(views, [PosedBody(gavrila, straight)]), [straight], COARSE):
        bends = step.candidate[0][
            [gavrila.value_names.index(n) for n in ("left_elbow.extension", "left_knee.extension")]
        ]
        assert np.all(bends >= 0)
        np.testing.assert_array_equal(gavrila.clip(step.best[0]), step.best[0])
        seen |= set(bends)
    assert len(seen) > 2
    # Every candidate, not only the cheapest of each step.
    asked = []

    class Recording(Counted):
        def of_person(self, person, candidates, poses):
            asked.extend(candidates)
            return super().of_person(person, candidates, poses)

    list(search(Recording(ChamferCost(views, [PosedBody(gavrila, straight)])), [straight], COARSE))
    for candidate in asked:
        np.testing.assert_array_equal(gavrila.clip(candidate), candidate)


def test_evaluations_are_counted(gavrila, views, start, steps):
    counted = Counted(ChamferCost(views, [PosedBody(gavrila, start)]))
    seen = 0
    for step in search(counted, [start], COARSE):
        assert seen < step.evaluations == counted.asked
        seen = step.evaluations
    assert steps[0].evaluations == 1 + 2 * 5  # the start, and both neighbours along each axis


def test_nothing_is_scored_twice_within_a_stage(gavrila, views, start):
    class Remembering(Counted):
        def of_person(self, person, candidates, poses):
            for candidate in candidates:
                assert candidate.tobytes() not in scored
                scored.add(candidate.tobytes())
            return super().of_person(person, candidates, poses)

    scored = set()
    cost = Remembering(ChamferCost(views, [PosedBody(gavrila, start)]))
    for step in search(cost, [start], COARSE):
        if step.stage_done:
            scored.clear()


@pytest.mark.parametrize(
    "steps",
    [
        {"torso__x": 0.05},
        {"torso__x": -0.05, "torso__z": 0.05, "torso__abduction": np.radians(5)},
        {"left_shoulder__abduction": np.radians(-10), "right_elbow__extension": np.radians(10)},
        {"left_hip__elevation": np.radians(5), "right_knee__extension": np.radians(-10)},
    ],
)
def test_finds_a_pose_that_lies_on_the_lattice_exactly(gavrila, truth, views, steps):
    start = displaced(gavrila, truth, **steps)
    *_, last = search(ChamferCost(views, [PosedBody(gavrila, start)]), [start], COARSE)
    np.testing.assert_allclose(last.best[0], truth, atol=1e-9)


def test_bounds_and_steps_of_single_dofs(gavrila, views, start):
    settings = SearchSettings(bounds={"torso.x": 0.0}, steps={"torso.y": 0.02, "torso.abduction": 0.01}, passes=(1.0,))
    xs, ys, angles = set(), set(), set()
    for step in search(ChamferCost(views, [PosedBody(gavrila, start)]), [start], settings):
        change = gavrila.difference(step.candidate[0], start)
        xs.add(change[0])
        ys.add(round(change[1] / 0.02, 6))
        angles.add(round(change[3] / 0.01, 6))
    assert xs == {0.0}
    assert all(y == round(y) for y in ys)
    assert all(a == round(a) for a in angles)
    bounds, spacing = settings.lattice(gavrila, [0, 1, 3, 4])
    np.testing.assert_allclose(bounds, [0, 0.1, np.radians(15), np.radians(15)])
    np.testing.assert_allclose(spacing, [0.05, 0.02, 0.01, np.radians(5)])


def test_patience_and_the_largest_number_of_expansions(gavrila, views, truth):
    cost = ChamferCost(views, [PosedBody(gavrila, truth)])
    # At the truth nothing is better: each stage ends when patience does.
    found = list(search(cost, [truth], SearchSettings(passes=(1.0,), patience=2)))
    assert [s.stage_done for s in found] == [False, True] * 3
    np.testing.assert_array_equal(found[-1].best[0], truth)
    found = list(search(cost, [truth], SearchSettings(passes=(1.0,), patience=99, max_expansions=4)))
    assert [s.stage_done for s in found] == [False, False, False, True] * 3


def test_a_stage_without_room_still_yields_one_step(gavrila, views, truth):
    cost = ChamferCost(views, [PosedBody(gavrila, truth)])
    found = list(search(cost, [truth], SearchSettings(bound_rad=0, bound_m=0, passes=(1.0,))))
    assert [s.stage_done for s in found] == [True] * 3
    assert found[-1].evaluations == 1
    np.testing.assert_array_equal(found[-1].candidate[0], truth)


def test_people_one_after_the_other(gavrila, truth):
    other = gavrila.with_height(1.6)
    truths = [displaced(gavrila, truth, torso__y=-0.6), displaced(other, truth, torso__y=0.6)]
    views = own_evidence([PosedBody(gavrila, truths[0]), PosedBody(other, truths[1])], cameras_around())
    starts = [displaced(gavrila, truths[0], torso__x=0.05), displaced(other, truths[1], torso__z=-0.05)]
    cost = ChamferCost(views, [PosedBody(gavrila, starts[0]), PosedBody(other, starts[1])])
    order = [(s.person, s.group.name) for s in stages(cost.models, COARSE)]
    names = ["torso and head", "arms", "legs"]
    assert order == [(p, n) for p in (0, 1) for n in names]
    for step in search(cost, starts, COARSE):
        # Those before stand at their found poses, those after at their predicted ones.
        if step.stage.person == 0:
            np.testing.assert_array_equal(step.best[1], starts[1])
        else:
            np.testing.assert_allclose(step.best[0], truths[0], atol=1e-9)
            np.testing.assert_array_equal(step.candidate[0], step.best[0])
    np.testing.assert_allclose(step.best[1], truths[1], atol=1e-9)
    # Pass by pass: all people coarsely, then all people finely (GD96 Fig. 2).
    finer = stages(cost.models, SearchSettings(passes=(1.0, 0.5)))
    assert [(s.factor, s.person) for s in finer[::3]] == [(1.0, 0), (1.0, 1), (0.5, 0), (0.5, 1)]


def test_whom_to_search(gavrila):
    model = solid((0.1, 0.1, 0.1))
    balls = [at(model, 0, -0.5, 0), at(model, 0, 0.5, 0)]
    cost = ChamferCost(own_evidence(balls, cameras_around()), balls)
    starts = [displaced(model, b.values, root__x=0.05) for b in balls]
    for step in search(cost, starts, COARSE, people=[1]):
        assert step.stage.person == 1
        np.testing.assert_array_equal(step.best[0], starts[0])
    np.testing.assert_allclose(step.best[1], balls[1].values, atol=1e-9)
    assert list(search(cost, starts, COARSE, people=[])) == []


def test_the_papers_settings(gavrila, views, truth, start):
    paper = SearchSettings(passes=(1.0,))
    assert (paper.bound_rad, paper.step_rad) == pytest.approx((np.radians(15), np.radians(5)))
    assert (paper.bound_m, paper.step_m) == (0.10, 0.05)
    cost = ChamferCost(views, [PosedBody(gavrila, start)], outliers="paper")
    found = list(search(cost, [start], paper))
    assert {s.stage.factor for s in found} == {1.0}
    assert found[-1].best_px < cost([start]).total_px
    # One pass moves by whole steps alone.
    moved = gavrila.difference(found[-1].best[0], start) / np.where(gavrila.dof_is_length, 0.05, np.radians(5))
    np.testing.assert_allclose(moved, np.round(moved), atol=1e-9)


def test_limbs_apart(gavrila):
    """Degrees of freedom that move two limbs stay together, each limb is separate, and none is lost."""
    leaves = stages([gavrila], SearchSettings(passes=(1.0,), limbs_apart=True))
    assert [(s.name, len(s.group.dofs)) for s in leaves] == [
        ("torso and head", 5), ("arms: torso", 1), ("arms: left_shoulder", 4), ("arms: right_shoulder", 4),
        ("legs: left_hip", 4), ("legs: right_hip", 4),
    ]  # fmt: skip
    bending = load_model("gavrila34")
    leaves = stages([bending], SearchSettings(passes=(1.0,), limbs_apart=True))
    named = {s.name: s.group.dofs for s in leaves}
    assert set(named) == {
        "torso and head: torso", "torso and head: neck", "arms: torso", "arms: left_collarbone",
        "arms: right_collarbone", "legs: spine", "legs: left_hip", "legs: right_hip",
    }  # fmt: skip
    assert named["arms: left_collarbone"][-1] == "left_elbow.extension"
    assert sorted(d for dofs in named.values() for d in dofs) == sorted(bending.dof_names)
    ball = at(solid((0.2, 0.2, 0.2)), 0, 0, 0).model
    assert [s.group for s in stages([ball], COARSE_SEARCH)] == list(ball.search_groups)


@pytest.mark.slow
def test_a_refinement_makes_up_for_a_short_search(gavrila, views, truth):
    """From 8 degrees and 5 cm off in every degree of freedom, where a refinement alone fails."""

    def found(start, settings):
        *_, last = search(ChamferCost(views, [PosedBody(gavrila, start)]), [start], settings)
        return last.best[0], last.evaluations

    def refines(pose):
        blocks = [ContourResiduals(views, [PosedBody(gavrila, pose)]), PosePrior(pose, np.ones(gavrila.n_dofs))]
        values = solve(gavrila, pose, blocks, max_iterations=15, tolerance=1e-3, gain=MIN_DECREASE).pose
        return np.linalg.norm(gavrila.points_world(values) - gavrila.points_world(truth), axis=1).max() < 0.02

    starts = [gavrila.clip(shaken(gavrila, truth, np.random.default_rng(i), np.radians(8), 0.05)) for i in range(8)]
    near, scored = zip(*(found(s, COARSE_SEARCH) for s in starts), strict=True)
    assert max(scored) < 0.25 * found(starts[0], SearchSettings())[1]
    assert sum(map(refines, starts)) <= 3
    assert sum(map(refines, near)) >= 7
