"""The way of a pose between frames, by which a body is shown to cameras whose pictures were taken between them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import shortest_step
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class PosePath:
    """Way of a pose around a frame: a spline of Catmull and Rom (1974) through the poses.

    Its slope on each frame is the central difference. Beyond the known poses it goes on straight.
    """

    steps: Mapping[int, Array]
    """Steps from the pose of the frame to those around it, by the number of frames that they are later, without a gap:
    (n_dofs,), rad or metres. At least two, one of them for 0."""
    fps: float
    """Frames per second."""

    @classmethod
    def around(cls, model: BodyModel, poses: Mapping[int, Array], frame: int, fps: float) -> "PosePath":
        """Return the way of a pose around a frame, up to a second to each side.

        Args:
            model: the body of all poses.
            poses: by frame, (n_values,) each; of the frame and of one beside it at least.
            frame: the frame.
            fps: frames per second.
        """
        steps = {0: np.zeros(model.n_dofs)}
        for direction in (-1, 1):
            k = frame + direction
            while k in poses and abs(k - frame) <= fps:
                steps[k - frame] = shortest_step(model, poses[k], poses[frame])
                k += direction
        return cls(steps, fps)

    @classmethod
    def steady(cls, velocity: Array, fps: float) -> "PosePath":
        """Return the way of a pose that moves by a velocity, (n_dofs,), rad or metres per second."""
        return cls({0: np.zeros_like(velocity), 1: velocity / fps}, fps)

    def step(self, delay_s: float) -> Array:
        """Return the step of the pose from the frame to a time, (n_dofs,), rad or metres.

        Args:
            delay_s: by how much later than the frame it is, seconds.
        """
        return self._at(delay_s, 0)

    def velocity(self, delay_s: float) -> Array:
        """Return the change of the pose at a time, (n_dofs,), rad or metres per second; see `step`."""
        return self.fps * self._at(delay_s, 1)

    def _at(self, delay_s: float, derivative: int) -> Array:
        """Return the spline at a time, or its derivative by the time in frames."""
        first = floor(delay_s * self.fps)
        u = delay_s * self.fps - first
        a, b, c, d = (self._to(first + i) for i in range(-1, 3))
        cubic = ((3 * (b - c) + d - a) / 2, a - 2.5 * b + 2 * c - d / 2, (c - a) / 2)
        if derivative:
            return np.asarray((3 * u * cubic[0] + 2 * cubic[1]) * u + cubic[2])
        return np.asarray(((cubic[0] * u + cubic[1]) * u + cubic[2]) * u + b)

    def _to(self, i: int) -> Array:
        """Return the step to a frame, straight on beyond the last known one."""
        if i in self.steps:
            return self.steps[i]
        last, inward = (max(self.steps), -1) if i > 0 else (min(self.steps), 1)
        return self.steps[last] + abs(i - last) * (self.steps[last] - self.steps[last + inward])
