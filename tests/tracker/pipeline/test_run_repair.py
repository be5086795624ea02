"""Repair of a run whose tracks all have a leg elsewhere on some frames."""

from collections import Counter

import numpy as np
import pytest
from region_scenes import N_FRAMES, Filmed, Walk, limb_of
from staging import SUIT

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.body.searches import Search
from tracker.fitting.hypothesis import SAME_POSE_M, Hypothesis
from tracker.pipeline import run_repair
from tracker.pipeline.run_repair import RunRepair
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimation.limb_repair import MIN_GAIN_NATS, Repair
from tracker.tracking.subjects import Subjects
from tracker.tracking.view_tracks import FrameTracks


@pytest.fixture(scope="module")
def walk(gavrila):
    return Walk(gavrila, SUIT)


def repaired(walk, keyframes=None, replaces=True, active=None, alternatives=None, seen=None):
    """The steps of a repair whose tracks agree with one another on the wrong leg.

    `keyframes` are poses by frame that a person has set, `seen` those of the tracks where they are other ones.
    `replaces` is whether better poses take their place.
    `alternatives` are poses by frame that the tracker found about as good.
    """
    others = {(k, 0): [pose] for k, pose in (alternatives or {}).items()}
    n_limbs = len(limbs(walk.model))
    tracked = {k: b.values for k, (b,) in enumerate(walk.tracked)}
    tracks = {
        k: FrameTracks(np.array([pose] * 3), np.ones((3, n_limbs)), ("A", "B", "C"))
        for k, pose in (tracked | (seen or {})).items()
    }
    subjects = Subjects.of([walk.model], None, [active], {k: {0: pose} for k, pose in (keyframes or {}).items()})
    bodies = {k: (PosedBody(walk.model, pose),) for k, pose in (tracked | (keyframes or {})).items()}
    return list(RunRepair(Filmed(walk), subjects, TrackSettings(), bodies, {0: tracks}, others, replaces).steps())


def off_m(walk, k, pose):
    points = np.isin(walk.model.point_parts, limb_of(walk.model, "right_calf").parts)
    return np.linalg.norm(walk.model.points_world(pose) - walk.true[k][0].points_world, axis=1)[points].max()


@pytest.mark.slow
def test_a_leg_is_found_that_all_tracks_have_elsewhere(walk):
    *before, last = repaired(walk)
    leg = [x.name for x in limbs(walk.model)].index("right_calf")
    assert all(step.found is None and 0 < step.done <= step.total for step in before)
    assert last.done == last.total
    found = last.found[0]
    assert sorted(found) == list(range(N_FRAMES))
    for k, is_wrong in enumerate(walk.wrong):
        pose, trust, elsewhere, against, *_ = found[k]
        assert elsewhere[leg] < 5
        assert len(against) == len(elsewhere)
        if is_wrong:
            assert off_m(walk, k, walk.tracked[k][0].values) > 2 * SAME_POSE_M > 1.5 * off_m(walk, k, pose)
            assert not trust[:, leg].any()  # all tracks are refuted, in the leg alone
            assert trust.sum() == trust.size - len(trust)
        else:
            assert np.abs(walk.model.points_world(pose) - walk.tracked[k][0].points_world).max() < 0.01  # metres
            assert trust.all()


@pytest.mark.slow
def test_a_leg_is_taken_that_only_all_frames_together_speak_for(walk, monkeypatch):
    """Each frame gains less than a repair asks for, and is no repair by itself."""

    def undecided(evidence, bodies, person, *args):
        k = next(k for k, views in enumerate(walk.views) if views is evidence.views)
        true = Hypothesis(walk.true[k][0], "repair", -0.7 * MIN_GAIN_NATS)
        entry = Search.of("repair", ("right_calf",), 0.0, true.cost, False)
        tracked, found = bodies[0].values, (true,) if walk.wrong[k] else ()
        return Repair(tracked, 0.0, 0.7 * MIN_GAIN_NATS, found, entry, tracked)

    monkeypatch.setattr(run_repair, "better_limbs", undecided)
    found = repaired(walk)[-1].found[0]
    leg = [x.name for x in limbs(walk.model)].index("right_calf")
    for k in np.flatnonzero(walk.wrong):
        assert np.array_equal(found[k].pose, walk.true[k][0].values)
        assert [entry.taken for entry in found[k].trace] == [True, False]
        assert not found[k].trust[:, leg].any()


@pytest.mark.slow
def test_a_keyframe_stays_and_is_doubted(walk):
    frame = int(np.flatnonzero(walk.wrong)[0])
    found = repaired(walk, {frame: walk.tracked[frame][0].values})[-1].found[0]
    leg = [x.name for x in limbs(walk.model)].index("right_calf")
    assert np.array_equal(found[frame].pose, walk.tracked[frame][0].values)
    assert found[frame].elsewhere[leg] > 10
    assert found[frame].against[leg].startswith("right calf elsewhere in ")


@pytest.mark.slow
@pytest.mark.parametrize("replaces", [True, False])
def test_a_keyframe_is_compared_with_the_places_of_tracks_and_stays(walk, replaces):
    """Also where poses are compared only."""
    leg = [x.name for x in limbs(walk.model)].index("right_calf")
    k = int(np.flatnonzero(walk.wrong)[0])
    true, wrong = walk.true[k][0].values, walk.tracked[k][0].values
    right = repaired(walk, {k: true}, replaces)[-1].found[0][k]
    assert np.array_equal(right.pose, true)
    assert not right.trust[:, leg].any()
    assert right.alternatives == ()
    assert off_m(walk, k, right.refined) < 0.05
    off = repaired(walk, {k: wrong}, replaces, seen={k: true})[-1].found[0][k]
    assert np.array_equal(off.pose, wrong)
    (better,), (entry,) = off.alternatives, off.trace
    assert better.cost < -MIN_GAIN_NATS
    assert off_m(walk, k, better.pose) < SAME_POSE_M
    assert not entry.taken


@pytest.mark.slow
def test_frames_beside_a_keyframe_that_is_wrong_are_examined_once(walk, monkeypatch):
    """It stays, so that nothing new is known there."""
    examined, better_limbs = Counter(), run_repair.better_limbs

    def counted(evidence, *args):
        examined[next(k for k, views in enumerate(walk.views) if views is evidence.views)] += 1
        return better_limbs(evidence, *args)

    monkeypatch.setattr(run_repair, "better_limbs", counted)
    wrong = [int(k) for k in np.flatnonzero(walk.wrong)]
    keyframes, true = ({k: of[k][0].values for k in wrong} for of in (walk.tracked, walk.true))
    repaired(walk, keyframes, seen=true)
    assert set(wrong) < set(examined)
    assert set(examined.values()) == {1}


@pytest.mark.slow
def test_poses_that_are_compared_only_stay(walk):
    found = repaired(walk, replaces=False)[-1].found[0]
    assert all(np.array_equal(found[k].pose, body.values) for k, (body,) in enumerate(walk.tracked))


@pytest.mark.slow
def test_a_locked_leg_is_not_moved(walk):
    dofs = limb_of(walk.model, "right_calf").dofs
    found = repaired(walk, active=~dofs)[-1].found[0]
    values = walk.model.dof_value[dofs]
    for k, (body,) in enumerate(walk.tracked):
        assert np.array_equal(found[k].pose[values], body.values[values])


def test_alternatives_of_the_tracker_are_compared_again(walk, monkeypatch):
    """On frames where tracks agree and colours contradict nothing, they alone are a reason to look."""
    fine = np.flatnonzero(~np.array(walk.wrong))
    wrong = [walk.tracked[k][0].values for k in np.flatnonzero(walk.wrong)[:2]]
    asked = {}

    def compared(evidence, bodies, person, settings, searched, others, tried):
        k = next(k for k, views in enumerate(walk.views) if views is evidence.views)
        asked[k] = [x.name for x in tried], others
        same, other = bodies[0], PosedBody(walk.model, wrong[0])
        found = Hypothesis(other, "repair", 11.5), Hypothesis(other, "repair", 14.0), Hypothesis(same, "repair", 10.0)
        entry = Search.of("repair", ("right_calf",), 10.0, 11.5, False)
        return Repair(same.values, 10.0, 0.0, found if k in fine[:2] else (), entry, same.values)

    monkeypatch.setattr(run_repair, "better_limbs", compared)
    monkeypatch.setattr(run_repair, "select_alternatives", lambda frames, gain: [0] * len(frames))
    found = repaired(walk, alternatives=dict(zip(fine[:2], wrong, strict=True)))[-1].found[0]
    for k, pose in zip(fine[:2], wrong, strict=True):
        tried, others = asked[k]
        assert "right_calf" in tried
        assert any(np.array_equal(pose, other) for other in others)
        (rival,) = found[k].alternatives  # neither the same pose, nor one that is clearly worse
        assert rival.cost == pytest.approx(1.5)
    assert all(found[k].alternatives == () for k in fine[2:])
    (rival,) = repaired(walk, replaces=False)[-1].found[0][fine[0]].alternatives  # also of poses that are compared only
    assert rival.cost == pytest.approx(1.5)
