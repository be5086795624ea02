"""Assess one pose by tracks that come to it from both sides."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from command_line import SAMPLE
from run_with_doubt import DOUBTED, WRONG_FRAME, store_run

from tracker.body.limbs import limbs
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.pipeline.pose_check import PoseInRun, checked_pose, frames_around
from tracker.store.stored_poses import read_stored_poses
from tracker.tracking.chamfer.settings import TrackSettings


@pytest.mark.parametrize(
    ("posed", "ways"),
    [
        (range(50), [range(12, 21), range(28, 19, -1)]),
        (range(17, 22), [range(17, 21), range(21, 19, -1)]),
        ([2, 5, 8, 11, 14, 17, 20], [range(2, 21, 3)]),  # at a stride of 3
        ([3, 4, 20, 22], [range(4, 21, 16), range(22, 19, -2)]),
        ([20], []),
    ],
)
def test_tracks_begin_where_they_have_time_to_come_apart(posed, ways):
    assert [list(way) for way in frames_around(20, list(posed))] == [list(way) for way in ways]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The session of a run with a wrong arm, its stored poses, and its observer."""

    session = store_run(shutil.copytree(SAMPLE, tmp_path_factory.mktemp("check") / "session"))
    poses = read_stored_poses(session.annotations_path, "person", session.people[0].model)
    with Recording(session.cameras) as recording:
        yield session, poses, Observer(session.cameras, recording)


def assessed(run, values, n_views=4):
    session, poses, observer = run
    record = replace(poses[WRONG_FRAME].record, values=values, status="", limbs_lost=(), keyframe=True)
    known = {k: [p.body.values] for k, p in poses.items()} | {WRONG_FRAME: [values]}
    seen = observer if n_views == 4 else observer.with_cameras(range(n_views))
    return checked_pose(session, seen, TrackSettings(), PoseInRun(WRONG_FRAME, 0, record, known))


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
    assert wrong.remark.startswith("left arm uncertain without ")


def test_two_cameras_assess_nothing(run):
    with pytest.raises(TrackerError, match="found 2 cameras and poses on 2 sides; it stays without a status"):
        assessed(run, run[1][WRONG_FRAME].body.values, 2)
