"""Stands for the estimate of all frames of a run together."""

import numpy as np

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.searches import Search
from tracker.tracking.runs.path_assessment import RunPose
from tracker.tracking.runs.run_estimate import Progress


class FakeEstimate:
    """Moves each first guess by the same step, and finds the left arm elsewhere on some frames."""

    def __init__(self, step_m=0.0, doubted=()):
        """Be asked nothing yet.

        Args:
            step_m: along y.
            doubted: frames on which the left arm is elsewhere with the mass of half of the paths.
        """
        self.step_m, self.doubted = step_m, doubted
        self.asked = []
        """Runs that were asked for."""

    def __call__(self, run):
        self.asked.append(run)
        found = {i: {} for i in run.subjects.tracked}
        for done, (frame, poses) in enumerate(run.poses.items(), 1):
            for i, of_person in found.items():
                of_person[frame] = self._pose(run, frame, i, poses[i])
            yield Progress(done, len(run.poses))
        return found

    def _pose(self, run, frame, person, pose):
        model, stays = run.subjects.models[person], run.stays or person in run.subjects.keyframes_at(frame)
        is_arm = np.array([limb_display_name(limb.name) == "left arm" for limb in limbs(model)])
        assert is_arm.any()
        return RunPose(
            pose if stays else pose + self.step_m * (np.arange(len(pose)) == 1),
            None if stays or frame not in self.doubted else Search.of("path", ("left arm",), 2.0, 1.0, True),
            np.ones(len(model.parts)),
            np.tile(1e-6 * np.eye(3), (len(model.point_names), 1, 1)), 0.5 * (is_arm & (frame in self.doubted)),
            np.full(len(is_arm), -10.0), ("",) * len(is_arm), False, (), 1.5, (1.0,) * len(run.observer.cameras),
        )  # fmt: skip
