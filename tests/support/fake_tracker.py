"""Stands for the chamfer tracker: walks along x by a centimetre a frame, and goes on only when told."""

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from gestures import wait_for

from tracker.estimation.chamfer.method import CHAMFER
from tracker.estimation.tracking.tracker import PoseEstimate
from tracker.pipeline.methods import METHODS

STEP_M = 0.01
N_PARTS, N_VIEWS = 10, 4
LIMBS = SimpleNamespace(lost_probabilities=np.array([0.25, 0.0001]), is_unseen=True)
"""What it knows of the limbs of a frame. Its statuses stay at the end of a run."""


class Walker:
    """A tracker that walks along x by a centimetre a frame and finds every pose good."""

    def __init__(self, settings):
        """Track nothing yet."""
        self.settings = settings
        self.asked = []
        """Frames of each run that was asked for."""

    def estimates(self, run):
        self.asked.append(list(run.frames))
        models, poses = run.subjects.models, [np.atleast_2d(start)[-1] for start in run.start]
        n = len(poses)
        for frame in run.frames:
            poses = [p + STEP_M * (np.arange(len(p)) == 0) for p in poses]
            yield PoseEstimate(
                frame, tuple(poses), 1.0, np.ones(N_VIEWS), 0, ("good",) * n, ("",) * n,
                tuple(np.ones(len(m.parts)) for m in models), tuple(1e-4 * np.eye(m.n_dofs) for m in models),
                (None,) * n, ((),) * n, self.settings.method,
            )  # fmt: skip


class FakeTracker:
    """Frame 4 is doubtful, frames divisible by 7 are lost, and the second view sees no edge."""

    def __init__(self, monkeypatch):
        monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=self.with_settings))
        self.steps = threading.Semaphore(0)
        self.settings = None
        self.run = None
        """The last run."""
        self.seen = []
        """Frames that have been tracked."""
        self.fails_at = None
        self.last = {}
        """What was found last on each frame."""
        self.whole_runs = False
        """Whether runs go on after their first pass; see `EstimationSettings.whole_run`."""

    def let_go(self, frames):
        """Let it track so many frames more."""
        for _ in range(frames):
            self.steps.release()

    def go_on(self, controller, frames, at=None):
        """Let it track so many frames more, and wait until the run is at a frame, or at its end."""
        self.let_go(frames)
        wait_for(lambda: controller.state.track.message if at is None else controller.state.track.at == at)

    def track(self, controller, until, frames, at=None, backward=False):
        """Start a run, and go on."""
        controller.tracking.start(backward=backward, until=until)
        self.go_on(controller, frames, at)

    def with_settings(self, settings):
        """Stands for the tracker's constructor."""
        self.settings = settings if self.whole_runs else replace(settings, whole_run=False)
        return self

    def estimates(self, run):
        self.run = run
        models, keyframes, poses = run.subjects.models, run.subjects.keyframes, list(run.start)
        for frame in run.frames:
            end = time.monotonic() + 20.0
            while not self.steps.acquire(timeout=0.01):
                assert time.monotonic() < end, "nobody let the tracker go on"
            if frame == self.fails_at:
                raise RuntimeError("no light")
            for i in run.subjects.tracked:
                step = STEP_M * (np.arange(len(poses[i])) == 0)
                poses[i] = keyframes.get(frame, {}).get(i, poses[i] + step)
            status = "doubtful" if frame == 4 else "lost" if frame % 7 == 0 else "good"
            remark = "left arm relocated" if frame == 4 else ""
            self.seen.append(frame)
            view_costs_px = np.array([1.0, np.nan, 2.0, 3.0])[: len(run.observer.cameras)]
            part_costs_px = np.array([0.5] * (N_PARTS - 1) + [np.nan])
            n = len(models)
            self.last[frame] = PoseEstimate(
                frame, tuple(poses), 1.0 + 0.1 * frame, view_costs_px, 9, (status,) * n, (remark,) * n,
                (part_costs_px,) * n, tuple(np.eye(m.n_dofs) for m in models), (LIMBS,) * n, ((),) * n, "chamfer",
            )  # fmt: skip
            yield self.last[frame]
