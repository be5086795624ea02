"""Stretches between keyframes: which are tracked, what is stored of the two passes, and what is left alone."""

import shutil
from dataclasses import dataclass, replace

import numpy as np
import pytest
from run_poses import Estimate
from stored_motions import put_poses

from tracker.errors import TrackerError
from tracker.estimation.chamfer.method import CHAMFER
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import PoseEstimate
from tracker.pipeline import track_session
from tracker.pipeline.keyframe_stretches import KeyframeStretch, frames_of, stretches_to_track
from tracker.pipeline.methods import METHODS
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

APART_M = {3: 0.04, 8: 0.3}
"""Distance of the passes on a frame of each stretch; elsewhere they agree."""
KEYFRAMES = (0, 5, 10)
SETTINGS = TrackSettings()


@dataclass
class TwoPasses:
    """Stands for a tracker: nobody moves, and the pass backward is beside the other on some frames."""

    settings: TrackSettings

    def estimates(self, run):
        is_backward = len(run.frames) > 1 and run.frames[0] > run.frames[-1]
        for frame in run.frames:
            keyframes = run.subjects.keyframes_at(frame)
            aside = is_backward * APART_M.get(frame, 0) * (np.arange(len(run.start[0][-1])) == 0)
            poses = tuple(keyframes.get(i, s[-1] + aside) for i, s in enumerate(run.start))
            n = run.subjects.models[0].n_dofs
            yield PoseEstimate(
                frame, poses, 1.0, np.ones(4), 0, ("good",), ("",), (np.ones(10),), (np.eye(n),), (None,), ((),),
                "chamfer",
            )  # fmt: skip


@pytest.fixture
def session(tmp_path, sample_folder, monkeypatch):
    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=TwoPasses))
    monkeypatch.setattr(track_session, "estimate_run", Estimate(0.01))
    return load_session(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    store = AnnotationStore(session.annotations_path)
    for frame in KEYFRAMES:
        set_keyframe(session, store, frame)
    yield store
    store.close()


def set_keyframe(session, store, frame, x_m=0.0):
    (person,) = session.people
    values = person.model.neutral()
    values[0] += x_m
    put_poses(store, person, {frame: values}, label="set", keyframe=True)


def track(session, store, frames=range(11)):
    with stored_run(session, store, None, TrackPlan(frames, (0,), SETTINGS)) as run:
        for step in run.steps():
            run.take(step)


def test_poses_between_keyframes_say_how_far_the_passes_lie_apart(session, store):
    track(session, store)
    poses = store.poses("person", range(11))
    seams = {k: record.seam_mm for k, record in poses.items()}
    assert seams == {k: None if k in KEYFRAMES else 1000 * APART_M.get(k, 0.0) for k in range(11)}
    assert poses[3].settings["between"] == [0, 5]
    assert [poses[k].status for k in (2, 3, 8)] == ["good", "good", "lost"]
    assert "uncertain: tracked from frames 5 and 10, it lies 300 mm apart" in poses[8].remark
    assert poses[3].remark == ""
    # half the square of the distance, along the axis on which they are apart
    assert poses[8].errors[0, 0, 0] - poses[7].errors[0, 0, 0] == pytest.approx(0.3**2 / 2, rel=0.01)
    assert {k: poses[k].values[1] for k in (2, 3, 7, 8)} == pytest.approx(
        dict.fromkeys((2, 3, 7, 8), 0.01)
    )  # estimated


def test_after_a_correction_only_the_stretches_beside_it_are_tracked(session, store):
    def to_track(within=range(11)):
        return stretches_to_track(session, store, (0,), within)

    assert to_track() == {(0,): [KeyframeStretch(0, 5), KeyframeStretch(5, 10)]}
    track(session, store)
    assert to_track() == {}
    set_keyframe(session, store, 10, 0.01)
    assert to_track() == {(0,): [KeyframeStretch(5, 10)]}
    assert to_track(range(9)) == {}
    set_keyframe(session, store, 5, 0.01)
    assert to_track() == {(0,): [KeyframeStretch(0, 5), KeyframeStretch(5, 10)]}
    track(session, store, frames_of([KeyframeStretch(0, 5)]))
    assert to_track() == {(0,): [KeyframeStretch(5, 10)]}
    store.commit("clear", [PoseChange("person", 2, None)])
    assert to_track() == {(0,): [KeyframeStretch(0, 5), KeyframeStretch(5, 10)]}
    set_keyframe(session, store, 7)  # divides a stretch: both parts are tracked from other keyframes
    assert to_track()[(0,)][1:] == [KeyframeStretch(5, 7), KeyframeStretch(7, 10)]
    with pytest.raises(TrackerError, match="two keyframes with other frames between them in frames 1 to 4"):
        to_track(range(1, 5))


def test_frames_with_a_gap_are_tracked_as_legs_of_their_own():
    plan = TrackPlan(
        frames_of([KeyframeStretch(20, 23), KeyframeStretch(5, 8), KeyframeStretch(8, 10)]), (0,), SETTINGS
    )
    assert plan.legs == [[5, 6, 7, 8, 9, 10], [20, 21, 22, 23]]
    assert TrackPlan(range(9, 0, -4), (0,), SETTINGS).legs == [range(9, -3, -4)]
    assert TrackPlan([4], (0,), SETTINGS).legs == [[4]]
