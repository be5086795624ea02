"""Assess one pose by the frames around it."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from command_line import SAMPLE
from run_poses import Estimate
from run_with_doubt import DOUBTED, WRONG_FRAME, store_run

from tracker.body.limbs import limbs
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.evidence.observer import open_observer
from tracker.pipeline import pose_check
from tracker.pipeline.pose_check import PoseInRun, checked_pose, compared_pose, frames_around
from tracker.session.store.stored_poses import read_stored_poses


@pytest.mark.parametrize(
    ("posed", "frames"),
    [
        (range(50), range(12, 29)),
        (range(17, 22), range(17, 22)),
        ([2, 5, 8, 11, 14, 17, 20], range(2, 21, 3)),  # at a stride of 3
        ([3, 4, 20, 22], [4, 20, 22]),
        ([0, 18, 19, 20, 21], [18, 19, 20, 21]),
        ([20], [20]),
    ],
)
def test_a_pose_is_compared_over_the_frames_up_to_a_gap(posed, frames):
    assert frames_around(20, list(posed)) == list(frames)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The session of a run with a wrong arm, its stored poses, and its observer."""

    session = store_run(shutil.copytree(SAMPLE, tmp_path_factory.mktemp("check") / "session"))
    poses = read_stored_poses(session.annotations_path, "person", session.people[0].model)
    with open_observer(session.cameras) as observer:
        yield session, poses, observer


def assessed(run, values):
    session, poses, observer = run
    record = replace(poses[WRONG_FRAME].record, values=values, status="", limbs_lost=(), keyframe=True)
    known = {k: [p.body.values] for k, p in poses.items()} | {WRONG_FRAME: [values]}
    comparison = compared_pose(session, observer, TrackSettings(), PoseInRun(WRONG_FRAME, 0, known))
    return checked_pose(session.people[0].model, record, comparison)


@pytest.mark.slow
def test_a_right_pose_is_good_and_a_wrong_one_says_where(run):
    session, poses, _ = run
    model = session.people[0].model
    arm = [x.name for x in limbs(model)].index(DOUBTED)
    # The true pose is between its neighbours.
    right = assessed(run, 0.5 * (poses[WRONG_FRAME - 1].body.values + poses[WRONG_FRAME + 1].body.values))
    assert (right.status, right.remark, right.keyframe) == ("good", "", True)
    assert right.errors.shape == (len(model.point_names), 3, 3)
    wrong = assessed(run, poses[WRONG_FRAME].body.values)
    assert (wrong.status, int(np.argmax(wrong.limbs_lost))) == ("lost", arm)
    assert wrong.remark.startswith("left arm uncertain")


@pytest.mark.parametrize(("n_views", "around"), [(1, 2), (2, 0)])
def test_one_camera_or_one_frame_assesses_nothing(run, n_views, around):
    session, poses, observer = run
    known = {k: [poses[k].body.values] for k in range(WRONG_FRAME - around, WRONG_FRAME + 1)}
    pose = PoseInRun(WRONG_FRAME, 0, known)
    found = f"found {n_views} cameras and poses on {around} frames around; it stays without a status"
    with pytest.raises(TrackerError, match=found):
        compared_pose(session, observer.with_cameras(range(n_views)), TrackSettings(), pose)


def test_the_poses_around_are_compared_and_stay(run, monkeypatch):
    session, poses, observer = run
    model, estimate = session.people[0].model, Estimate(known={WRONG_FRAME: {"elsewhere": np.full(4, 0.3)}})
    monkeypatch.setattr(pose_check, "estimate_run", estimate)
    active = np.arange(model.n_dofs) != 3
    known = {k: [p.body.values] for k, p in poses.items()}
    record = replace(poses[WRONG_FRAME].record, remark="by hand", keyframe=True)
    shown = []
    other = poses[WRONG_FRAME + 1].body.values
    compared = compared_pose(
        session, observer, TrackSettings(), PoseInRun(WRONG_FRAME, 0, known, [other], active),
        lambda stage, share, text="": shown.append((stage, share)),
    )  # fmt: skip
    checked = checked_pose(model, record, compared)
    (asked,) = estimate.asked
    assert {at: [p.pose.tobytes() for p in own] for at, own in asked.proposals.items()} == {
        (WRONG_FRAME, 0): [other.tobytes()]
    }
    assert sorted(asked.poses) == list(range(WRONG_FRAME - 8, WRONG_FRAME + 9))
    assert (asked.stays, asked.subjects.tracked, dict(asked.subjects.keyframes)) == (True, (0,), {})
    np.testing.assert_array_equal(asked.subjects.active_dofs[0], active)
    assert (checked.status, checked.keyframe, checked.values.tobytes()) == ("doubtful", True, record.values.tobytes())
    assert checked.remark == "left arm uncertain: elsewhere on 30% of the likely paths"
    assert (len(shown), shown[-1]) == (17, ("comparing poses", 1.0))
