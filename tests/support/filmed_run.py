"""A recording of a figure in its clothes that moves its arms and walks on, and what a run knows of it."""

import numpy as np
from staging import SUIT, Film, cameras_around, in_posture, painted

from tracker.body.model import PosedBody
from tracker.compute.progress import result_of
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.runs.run_estimate import RunFrames, estimate_run
from tracker.estimation.tracking.tracker import Subjects
from tracker.evidence.observer import Observer
from tracker.footage.camera_source import CameraSource

FPS = 25.0
SWINGS = {"left_shoulder.elevation": 0.5, "right_shoulder.elevation": 0.4, "left_elbow.extension": 0.3}


def moving(model, n_frames):
    """True poses, (n_frames, n_values): arms swing slowly, and the figure drifts along x."""
    poses = np.tile(in_posture(model), (n_frames, 1))
    t = np.arange(n_frames) / FPS
    poses[:, 0] += 0.3 * (t - t.mean()) / max(1.0, t[-1])
    for i, (name, reach) in enumerate(SWINGS.items()):
        poses[:, model.value_names.index(name)] += reach * np.sin(2 * np.pi * t / 1.6 + i)
    return np.array([model.clip(pose) for pose in poses])


class FilmedRun:
    """The recording of people in their true poses, (T, n_values) of each, seen by some cameras."""

    def __init__(self, model, *true, n_cameras=3, size=(320, 240)):
        self.model, self.true = model, true
        cameras = cameras_around(3, size=size)[:n_cameras]  # none opposite another
        film = Film.__new__(Film)
        bodies = [[PosedBody(model, pose) for pose in of_people] for of_people in zip(*true, strict=True)]
        film.frames = [[painted(here, c, SUIT) for c in cameras] for here in bodies]
        self.observer = Observer([CameraSource(c, footage=None) for c in cameras], film)

    def asked(self, first, *others, proposals=None, keyframes=None, active=None, stays=False):
        """A run of all frames with first guesses of each person, (T, n_values); keyframes of the first one by frame."""
        n, keyframes = 1 + len(others), {k: {0: v} for k, v in (keyframes or {}).items()}
        subjects = Subjects.of([self.model] * n, range(n), [active, *[None] * len(others)], keyframes)
        poses = {k: tuple(map(np.array, of_people)) for k, of_people in enumerate(zip(first, *others, strict=True))}
        return RunFrames(self.observer, subjects, TrackSettings(), FPS, poses, proposals or {}, stays=stays)

    def errors_m(self, found, person=0):
        """Largest distance of a point of a person from its true place by frame, (T,)."""
        model = self.model
        off = [model.points_world(found[k].pose) - model.points_world(p) for k, p in enumerate(self.true[person])]
        return np.linalg.norm(off, axis=-1).max(axis=-1)


def estimated(run, person=0):
    """The poses of a person by frame."""
    return result_of(estimate_run(run))[person]
