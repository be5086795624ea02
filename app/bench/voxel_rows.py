"""The row of the voxel tracker in `quadrille bench`."""

import itertools
from contextlib import closing

import numpy as np

from app.bench.rows import Row, Yardstick, in_yardsticks
from app.bench.sample_frames import FRAME, BenchFrame, pose_at
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.estimation.voxel.frame_estimator import VoxelEstimator
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.footage.recording import Recording

_VOXEL_M = 0.05
_FRAMES = range(FRAME, FRAME + 8)
_MUST, _AIM = in_yardsticks(10), in_yardsticks(5)
"""Largest allowed and desired processor time, in yardsticks."""


def voxel_frame(frame: BenchFrame, yardstick: Yardstick) -> Row:
    """Time one frame of the voxel tracker: predict, carve, label, update, assess; silhouettes are found before."""
    with Recording(frame.session.cameras) as recording:
        with closing(SilhouetteFinder(frame.session.cameras, recording)) as finder:
            silhouettes = [finder.silhouettes(k) for k in _FRAMES]
        start = pose_at(frame.joints, frame.model, _FRAMES[0])
        run = TrackingRun(
            Observer(frame.session.cameras, recording), Subjects.of([frame.model]), [start], _FRAMES, frame.session.fps
        )
        estimator = VoxelEstimator(run, VoxelSettings(voxel_m=_VOXEL_M))
        estimator.estimate(_FRAMES[0], silhouettes[0])
        there_and_back = itertools.cycle([*range(1, len(silhouettes)), *range(len(silhouettes) - 2, 0, -1)])

        def work() -> None:
            i = next(there_and_back)
            estimator.estimate(_FRAMES[i], silhouettes[i])

        timed = yardstick.beside(work, runs=40)
    lost = np.linalg.norm(estimator.states[0].center - frame.model.points_world(start).mean(axis=0)) > 1.0
    note = "lost the person" if lost else ""
    return Row("voxel_frame", "voxel tracker, one frame, 50 mm, 4 views", *timed, _MUST, _AIM, note)
