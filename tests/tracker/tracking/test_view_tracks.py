"""Tracks without each view in turn."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.session.session import load_session
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun
from tracker.tracking.view_tracks import left_out, tracks_without_views


def test_each_track_lacks_a_view():
    assert left_out(2) == left_out(1) == []
    assert left_out(3) == [[1, 2], [0, 2], [0, 1]]
    groups = left_out(14)
    assert len(groups) == 6
    lacking = [set(range(14)) - set(group) for group in groups]
    assert set.union(*lacking) == set(range(14))
    assert sum(map(len, lacking)) == 14


@dataclass
class Walker:
    """Stands for a tracker: walks by a centimetre a frame, is 10 cm aside without LEFT, and lost without BACK."""

    settings: TrackSettings

    def estimates(self, run):
        names = [c.camera.name for c in run.observer.cameras]
        n = run.subjects.models[0].n_dofs
        for i, frame in enumerate(run.frames):
            assert len(run.regions(frame)) == len(names)
            assert not run.searches_around  # they doubt because a view is missing
            pose = np.array(run.start[0][-1])
            pose[:2] += 0.01 * i, 0.0 if "LEFT" in names else 0.1
            lost = np.array([0.0, 0.9])
            quality = SimpleNamespace(limbs=lost, lost_probabilities=lost, is_unseen="BACK" not in names)
            yield PoseEstimate(
                frame, (pose,), 1.0, np.ones(len(names)), 0, ("good",), ("",), (np.ones(1),), (np.eye(n),), (quality,),
                ((),), "chamfer",
            )  # fmt: skip


@pytest.fixture
def recorded(sample_folder):
    session = load_session(sample_folder)
    with Recording(session.cameras) as recording:
        yield session, Observer(session.cameras, recording)


def test_the_tracks_go_through_the_frames_side_by_side(recorded):
    session, observer = recorded
    model, frames = session.people[0].model, [4, 3, 2]
    start = model.neutral()
    run = TrackingRun(observer, Subjects.of([model]), [[start, start]], frames)
    found = list(tracks_without_views(Walker(TrackSettings()), run, {k: [start] for k in frames}))
    assert [frame for frame, _ in found] == frames
    tracks = found[2][1][0]
    names = [c.camera.name for c in session.cameras]
    assert tracks.without == tuple(names)
    np.testing.assert_allclose(tracks.poses[:, 0] - start[0], 0.02)
    np.testing.assert_allclose(tracks.poses[:, 1] - start[1], [0.1 * (name == "LEFT") for name in names])
    np.testing.assert_allclose(tracks.trust, [[0.0, 0.0] if name == "BACK" else [1.0, 0.1] for name in names])


def test_two_views_have_no_tracks(recorded):
    session, observer = recorded
    model = session.people[0].model
    run = TrackingRun(observer.with_cameras([0, 1]), Subjects.of([model]), [model.neutral()], [0, 1])
    assert list(tracks_without_views(Walker(TrackSettings()), run, {})) == []


def test_an_error_of_one_track_ends_all(recorded):
    session, observer = recorded
    model = session.people[0].model
    run = TrackingRun(observer, Subjects.of([model]), [[model.neutral()]], [0, 1])
    broken = replace(run, frames=[0])

    class Broken(Walker):
        def estimates(self, run):
            if len(run.observer.cameras) == 3 and "LEFT" not in [c.camera.name for c in run.observer.cameras]:
                raise OSError("the footage is gone")
            return super().estimates(run)

    with pytest.raises(OSError, match="footage"):
        list(tracks_without_views(Broken(TrackSettings()), broken, {0: [model.neutral()]}))
