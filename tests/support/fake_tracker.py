"""Stands for `track_chamfer`: walks along x by a centimetre a frame, and goes on only when told."""

import threading
import time
from typing import NamedTuple

import numpy as np

STEP_M = 0.01
N_PARTS, N_VIEWS = 10, 4


class Estimate(NamedTuple):
    frame: int
    poses: tuple
    cost_px: float
    views_px: np.ndarray
    evaluations: int
    statuses: tuple
    remarks: tuple
    parts_px: tuple
    covariances: tuple
    alternatives: tuple


class FakeTracker:
    """Frame 4 is doubtful, frames divisible by 7 are lost, and the second view sees no edge."""

    def __init__(self, monkeypatch):
        monkeypatch.setattr("app.control.tracking.tracking.track_chamfer", self.track)
        monkeypatch.setattr("app.control.tracking.tracking.follow_back", self.follow_back)
        self.steps = threading.Semaphore(0)
        self.told = None
        """Arguments of the last run."""
        self.seen = []
        """Frames that have been tracked."""
        self.fails_at = None
        self.last = {}
        """What was found last on each frame."""
        self.back = None
        """Makes the steps of the second pass from what was tracked; None: there is nothing to follow back."""

    def let_go(self, frames):
        """Let it track so many frames more."""
        for _ in range(frames):
            self.steps.release()

    def track(self, observer, models, start, frames, settings, fixed=None, people=None, free=None):
        self.told = {"frames": frames, "fixed": fixed, "people": people, "settings": settings, "free": free}
        poses = list(start)
        for frame in frames:
            end = time.monotonic() + 20.0
            while not self.steps.acquire(timeout=0.01):
                assert time.monotonic() < end, "nobody let the tracker go on"
            if frame == self.fails_at:
                raise RuntimeError("no light")
            for i in people:
                poses[i] = fixed.get(frame, {}).get(i, poses[i] + STEP_M * (np.arange(len(poses[i])) == 0))
            status = "doubtful" if frame == 4 else "lost" if frame % 7 == 0 else "good"
            remark = "left arm searched anew" if frame == 4 else ""
            self.seen.append(frame)
            views_px = np.array([1.0, np.nan, 2.0, 3.0])
            parts_px = np.array([0.5] * (N_PARTS - 1) + [np.nan])
            n = len(models)
            self.last[frame] = Estimate(
                frame, tuple(poses), 1.0 + 0.1 * frame, views_px, 9, (status,) * n, (remark,) * n, (parts_px,) * n,
                tuple(np.eye(m.n_dofs) for m in models), ((),) * n,
            )  # fmt: skip
            yield self.last[frame]

    def follow_back(self, observer, models, found, settings, fixed, people, free):
        yield from () if self.back is None else self.back(found)
