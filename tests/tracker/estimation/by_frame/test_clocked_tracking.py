"""Tracking of views one of which takes its pictures half a frame later."""

from dataclasses import replace

import numpy as np
import pytest
from staging import Shown, cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.tracking.tracker import Subjects, TrackingRun

LATE, N_FRAMES = 1, 6


class LateView(Shown):
    """Evidence one view of which is of a later time; `ahead` is what the session says of it."""

    def __init__(self, views, ahead):
        timed = [[replace(v, ahead_frames=ahead * (i == LATE)) for i, v in enumerate(of_frame)] for of_frame in views]
        super().__init__([tuple(of_frame) for of_frame in timed])
        self.ahead = ahead

    def ahead_frames(self, k):
        return tuple(self.ahead * (i == LATE) for i in range(len(self.working_cameras)))


@pytest.fixture(scope="module")
def motion(gavrila):
    rate = np.where(gavrila.dof_is_length, 0.03, 0.06) * np.sign(np.sin(np.arange(gavrila.n_dofs)))
    poses = [gavrila.retract(posed(gavrila, 3), k * rate) for k in range(-2, N_FRAMES)]
    views = [
        [
            own_evidence([PosedBody(gavrila, p, rate).ahead(0.5 * (i == LATE))], [c])[0]
            for i, c in enumerate(cameras_around(4))
        ]
        for p in poses[2:]
    ]
    return poses, views


def error_mm(model, motion, ahead, frames):
    poses, views = motion
    before = poses[:2] if frames[0] < frames[-1] else poses[:-3:-1]
    run = TrackingRun(LateView(views, ahead), Subjects.of([model]), [before], frames)
    found = {e.frame: e.poses[0] for e in ChamferTracker(TrackSettings(segments=False)).estimates(run)}
    off = [model.points_world(found[k]) - model.points_world(poses[k + 2]) for k in frames]
    return 1000 * float(np.linalg.norm(off, axis=-1).mean())


@pytest.mark.parametrize("frames", [range(N_FRAMES), range(N_FRAMES - 3, -1, -1)], ids=["forward", "backward"])
def test_known_time_of_a_late_view_makes_tracks_better(gavrila, motion, frames):
    timed, untimed = (error_mm(gavrila, motion, ahead, list(frames)) for ahead in (0.5, 0.0))
    assert timed < 0.7 * untimed
