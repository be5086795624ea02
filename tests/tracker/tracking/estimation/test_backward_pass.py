"""What was lost is re-initialized: which frames, what is kept of them, and what stays as it is."""

import numpy as np
import pytest
from staging import SUIT, Shown, cameras_around, dressed, posed
from tracking_runs import track_back

from tracker.body.model import PosedBody
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import BackwardStep, TrackedFrame
from tracker.tracking.estimation.backward_pass import lost_intervals
from tracker.tracking.estimation.pose_paths import ROUNDS

N = 9
LOST = range(2, 5)
"""Frames of the staged scene on which the first pass has lost an arm."""


@pytest.fixture(scope="module")
def scene(gavrila):
    """A person who walks and swings an arm: true poses (N, n_values), their evidence, and poses of a first pass that
    has left the arm hanging on the frames `LOST`."""
    swing, step = gavrila.dof_names.index("left_shoulder.abduction"), np.zeros(gavrila.n_dofs)
    step[:2], step[swing] = (0.02, -0.015), np.radians(6)
    truth = [posed(gavrila, 1)]
    for _ in range(N - 1):
        truth.append(gavrila.clip(gavrila.retract(truth[-1], step)))
    views = [dressed([PosedBody(gavrila, v)], cameras_around(4), SUIT) for v in truth]
    first = np.array(truth)
    first[LOST, swing] -= np.radians(70)
    return gavrila, np.array(truth), views, first


def tracked(first, lost=LOST):
    return [TrackedFrame(k, (v,), ("lost" if k in lost else "good",)) for k, v in enumerate(first)]


def off_m(model, values, truth):
    return np.linalg.norm(model.points_world(values) - model.points_world(truth), axis=1).max()


@pytest.mark.slow
@pytest.mark.parametrize("backward", [False, True])
def test_a_lost_arm_is_improved_backward_from_where_it_is_trusted_again(scene, backward):
    model, truth, views, first = scene
    assert min(off_m(model, first[k], truth[k]) for k in LOST) > 0.25
    found = tracked(first)[:: -1 if backward else 1]
    steps = list(track_back(Shown(views), [model], found, TrackSettings()))
    way = list(LOST)[:: 1 if backward else -1]
    visits = way + ROUNDS * (way[::-1] + way)
    n = len(visits)
    assert steps == [BackwardStep(k, 0, i + 1, n, steps[-1].better if i + 1 == n else ()) for i, k in enumerate(visits)]
    better = steps[-1].better
    assert [e.frame for e in better] == way[::-1]  # in the order of tracking
    for estimate in better:
        assert off_m(model, estimate.poses[0], truth[estimate.frame]) < 0.03
        assert estimate.statuses == ("good",)
        assert estimate.notes == (f"tracked back from frame {1 if backward else 5}",)


def test_where_nobody_is_lost_nothing_is_looked_at(scene):
    model, _, views, first = scene
    observer = Shown(views)
    doubtful = [f._replace(statuses=("doubtful",)) if f.frame in LOST else f for f in tracked(first, ())]
    for found in (tracked(first, ()), doubtful, tracked(first, [])[:1], []):
        assert list(track_back(observer, [model], found, TrackSettings())) == []
    assert list(track_back(observer, [model], tracked(first), TrackSettings(), tracked=[])) == []
    assert observer.asked == []


def test_a_pose_that_was_right_stays_where_it_was_called_lost(scene):
    model, truth, views, _ = scene
    steps = list(track_back(Shown(views), [model], tracked(truth), TrackSettings()))
    assert [s.frame for s in steps[:3]] == [4, 3, 2]
    assert steps[-1].better == ()


def test_what_was_right_on_one_frame_is_carried_to_those_that_both_passes_lost(scene):
    model, truth, views, first = scene
    first = first.copy()
    first[5, model.dof_names.index("left_shoulder.abduction")] -= np.radians(70)  # where the way back begins
    first[3] = truth[3]
    found = [f._replace(statuses=("doubtful",)) if f.frame == 3 else f for f in tracked(first)]
    better = list(track_back(Shown(views), [model], found, TrackSettings(recover=None)))[-1].better
    assert [e.frame for e in better] == [2, 4]
    for estimate in better:
        assert off_m(model, estimate.poses[0], truth[estimate.frame]) < 0.03
        assert estimate.statuses == ("good",)
        assert estimate.notes == ("taken over from neighbouring frames",)
        ((entry,),) = estimate.traces
        assert (entry.kind, entry.taken) == ("path", True)
        assert entry.after_nats < entry.before_nats
        assert estimate.covariances[0].any()
        assert estimate.qualities[0] is not None


@pytest.mark.slow
def test_keyframes_and_locked_degrees_of_freedom_stay(scene):
    model, _, views, first = scene
    keyframes = {3: {0: first[3]}}
    steps = list(track_back(Shown(views), [model], tracked(first), TrackSettings(), keyframes=keyframes))
    # 2 from the keyframe, 4 from the frame after it
    assert [s.frame for s in steps] == [2] * (1 + 2 * ROUNDS) + [4] * (1 + 2 * ROUNDS)
    assert 3 not in [e.frame for s in steps for e in s.better]
    free = np.array([n != "right_elbow.extension" for n in model.dof_names])
    first = first.copy()
    first[:5, ~free] += 0.2
    better = list(track_back(Shown(views), [model], tracked(first), TrackSettings(), active_dofs=[free]))[-1].better
    assert len(better) == 3
    for estimate in better:
        np.testing.assert_array_equal(estimate.poses[0][~free], first[2, ~free])


@pytest.mark.slow
def test_the_others_stay_as_they_were_found(scene):
    model, truth, _, first = scene
    other = truth.copy()
    other[:, 0] += 1.2
    views = [
        dressed([PosedBody(model, a), PosedBody(model, b)], cameras_around(4), SUIT)
        for a, b in zip(truth, other, strict=True)
    ]
    odd = other + 0.03  # not where the evidence is, yet it stays
    found = [TrackedFrame(k, (odd[k], first[k]), ("doubtful", "lost" if k in LOST else "good")) for k in range(N)]
    steps = list(track_back(Shown(views), [model, model], found, TrackSettings()))
    assert {s.person for s in steps} == {1}
    assert [e.frame for e in steps[-1].better] == list(LOST)
    for estimate in steps[-1].better:
        np.testing.assert_array_equal(estimate.poses[0], odd[estimate.frame])
        assert off_m(model, estimate.poses[1], truth[estimate.frame]) < 0.05
        assert (estimate.notes[0], estimate.statuses[0]) == ("", "doubtful")


@pytest.mark.slow
def test_what_an_end_of_the_run_leaves_open_is_improved_backward_from_the_last_frame_that_is_not_lost(scene):
    model, _, views, first = scene
    found = [f._replace(statuses=("lost" if f.frame in LOST else "doubtful" if f.frame > 4 else "good",))
             for f in tracked(first)]  # fmt: skip
    steps = list(track_back(Shown(views), [model], found, TrackSettings()))
    assert [s.frame for s in steps[:6]] == [7, 6, 5, 4, 3, 2]
    assert {2, 3, 4} <= {e.frame for e in steps[-1].better}
    hopeless = [f._replace(statuses=("lost" if f.frame > 1 else "good",)) for f in tracked(first)]
    assert list(track_back(Shown(views), [model], hopeless, TrackSettings())) == []


@pytest.mark.parametrize(
    ("statuses", "expected"),
    [
        ("ggdggg", []),  # doubtful alone
        ("gglggg", [(2, 3)]),
        ("gdldgggg", [(1, 4)]),
        ("glggdg", [(1, 5)]),  # two good frames in between are not trusted
        ("glgggdg", [(1, 2)]),
        ("lggglggg", [(0, 1), (4, 5)]),
        ("ggl", [(2, 3)]),
        ("glKlggg", [(1, 2), (3, 4)]),  # a keyframe is
        ("glgKl", [(1, 2), (4, 5)]),
    ],
)
def test_lost_intervals(statuses, expected):
    names = {"g": "good", "d": "doubtful", "l": "lost", "K": "good"}
    found = lost_intervals([names[s] for s in statuses], [s == "K" for s in statuses])
    assert [(r.start, r.stop) for r in found] == expected


def between_keyframes(model, truth, first, views, **settings):
    """The steps between keyframes on the first and last frame."""
    keyframes = {k: {0: truth[k]} for k in (0, N - 1)}
    return list(track_back(Shown(views), [model], tracked(first, ()), TrackSettings(**settings), keyframes=keyframes))


def test_between_keyframes_all_is_tracked_from_both_and_the_passes_are_joined_where_they_agree(scene):
    """Nothing says that the arm was lost on the way: the costs of the frames where the passes are apart tell."""
    model, truth, views, first = scene
    steps = between_keyframes(model, truth, first, views)
    assert [s.frame for s in steps] == list(range(N - 2, 0, -1))  # once each, without a search
    assert (steps[-1].done, steps[-1].total) == (N - 2, N - 2)
    better, other = steps[-1].better, steps[-1].other_pass
    assert {*LOST} <= {e.frame for e in better}
    for estimate in better:
        assert off_m(model, estimate.poses[0], truth[estimate.frame]) < 0.03
    assert other.between == (0, N - 1)
    assert sorted(other.poses) == list(range(1, N - 1))
    for k in LOST:  # the pass that was not taken
        np.testing.assert_array_equal(other.poses[k], first[k])


def test_a_stretch_is_tracked_backward_whatever_the_direction_of_the_run(scene):
    model, truth, views, _ = scene
    found = tracked(truth, ())[::-1]
    keyframes = {k: {0: truth[k]} for k in (2, 5)}
    steps = list(track_back(Shown(views), [model], found, TrackSettings(), keyframes=keyframes))
    assert [s.frame for s in steps] == [3, 4]
    assert steps[-1].other_pass.between == (2, 5)


def test_neighbouring_keyframes_have_nothing_between_them(scene):
    model, truth, views, _ = scene
    keyframes = {k: {0: truth[k]} for k in (3, 4)}
    assert list(track_back(Shown(views), [model], tracked(truth, ()), TrackSettings(), keyframes=keyframes)) == []


def test_alternatives_take_part_where_the_passes_are_apart(scene):
    model, truth, views, first = scene
    other = truth.copy()
    other[:, model.dof_names.index("left_shoulder.abduction")] += np.radians(40)
    found = [f._replace(alternatives=((other[f.frame],),)) for f in tracked(first, ())]
    keyframes = {k: {0: truth[k]} for k in (0, N - 1)}
    steps = list(track_back(Shown(views), [model], found, TrackSettings(), keyframes=keyframes))
    better = {e.frame: e.poses[0] for e in steps[-1].better}
    assert {*LOST} <= better.keys()
    assert all(off_m(model, better[k], truth[k]) < 0.03 for k in LOST)


@pytest.mark.slow
def test_a_former_pose_that_fits_better_stays(scene):
    """Nothing says that the arm is lost, and no keyframe follows: the pose that is replaced tells."""
    model, truth, views, first = scene
    former = {k: {0: v} for k, v in enumerate(truth)}
    steps = list(track_back(Shown(views), [model], tracked(first, ()), TrackSettings(), former=former))
    (better,) = (s.better for s in steps)
    assert [e.frame for e in better] == list(LOST)
    for estimate in better:
        np.testing.assert_array_equal(estimate.poses[0], truth[estimate.frame])
        assert (estimate.statuses, estimate.notes) == (("good",), ("as before this run",))


def test_a_former_pose_that_fits_worse_is_replaced(scene):
    model, truth, views, first = scene
    former = {k: {0: v} for k, v in enumerate(first)}
    observer = Shown(views)
    steps = list(track_back(observer, [model], tracked(truth, ()), TrackSettings(), former=former))
    assert [s.better for s in steps] == [()]
    assert {*observer.asked} == {1, *LOST, 5}  # where they differ, and for the colours around
    assert list(track_back(observer, [model], tracked(first, ()), TrackSettings(), former=former)) == []


@pytest.mark.slow
def test_between_keyframes_a_former_pose_changes_neither_the_passes_nor_their_seam(scene):
    model, truth, views, first = scene
    keyframes = {k: {0: truth[k]} for k in (0, N - 1)}
    found, former = tracked(first, ()), {k: {0: truth[k]} for k in LOST}
    with_former = list(track_back(Shown(views), [model], found, keyframes=keyframes, former=former))[-1]
    assert {e.frame for e in with_former.better} >= {*LOST}
    assert {*with_former.better[1].notes} <= {"tracked back from frame 8", "as before this run"}
    for k in LOST:
        np.testing.assert_array_equal(with_former.other_pass.poses[k], first[k])


def test_locked_degrees_of_freedom_of_a_former_pose_do_not_come_back(scene):
    model, truth, views, first = scene
    free = np.array([n != "right_elbow.extension" for n in model.dof_names])
    former = {k: {0: v + 0.2 * ~free} for k, v in enumerate(truth)}
    found = tracked(first, ())
    better = list(track_back(Shown(views), [model], found, TrackSettings(), former=former, active_dofs=[free]))[
        -1
    ].better
    assert [e.frame for e in better] == list(LOST)
    for estimate in better:
        np.testing.assert_array_equal(estimate.poses[0][~free], first[estimate.frame, ~free])
