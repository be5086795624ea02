"""Poses as the estimate of a run returns them, and an estimate that stands for that of a run."""

import numpy as np

from tracker.body.limbs import Search, limbs
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.runs.run_estimate import Progress

N_VIEWS = 4
MOVED = Search("path", ("left_forearm",), 9.0, 2.0, True)
"""Entry of a pose that took the place of a first guess."""


def run_pose(model, pose, **known):
    """A pose that is sure, but for what is known otherwise; keywords as of `RunPose`."""
    n, n_points = len(limbs(model)), len(model.point_names)
    sure = RunPose(
        pose, None, np.ones(len(model.parts)), np.zeros((n_points, 3, 3)), np.zeros(n), np.full(n, -20.0), ("",) * n,
        np.ones(n, bool), False, (), 1.5, (0.5,) * N_VIEWS,
    )  # fmt: skip
    return sure._replace(**known)


def doubted(*frames):
    """Facts of some frames: another path was taken, and half of the paths have the left arm elsewhere still."""
    return {frame: {"entry": MOVED, "elsewhere": np.array([0.5, 0.0, 0.0, 0.0])} for frame in frames}


class Estimate:
    """Stands for `estimate_run`: each first guess moves along y, keyframes stay."""

    def __init__(self, step_m=0.1, known=None):
        """Be asked nothing yet.

        Args:
            step_m: along y, metres.
            known: keywords of `run_pose` by frame.
        """
        self.step_m, self.known, self.asked = step_m, known or {}, []

    def __call__(self, run):
        self.asked.append(run)
        found = {i: {} for i in run.subjects.tracked}
        for done, (frame, poses) in enumerate(sorted(run.poses.items()), start=1):
            yield Progress(done, len(run.poses))
            for i, own in found.items():
                pose, known = np.array(poses[i]), dict(self.known.get(frame, {}))
                if run.stays or i in run.subjects.keyframes_at(frame):
                    known.pop("entry", None)
                else:
                    pose[1] += self.step_m
                own[frame] = run_pose(run.subjects.models[i], pose, **known)
        return found
