"""Velocities of poses, by which a body is shown to cameras whose pictures were taken between frames."""

from collections.abc import Mapping, Sequence

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.shortest_step import shortest_step
from tracker.geometry.arrays import Array

NEAR = (-2, -1, 0, 1, 2)
"""Frames whose poses a velocity depends on, from its own."""


def velocity(model: BodyModel, poses: Mapping[int, Array], frame: int) -> Array | None:
    """Return the change of a pose from one frame to the next, (n_dofs,), rad or metres; None without a neighbour.

    It is the central difference, averaged over three frames where the poses of two frames to both sides are known. At
    the end of known poses it is the difference from the only neighbour.

    Args:
        model: the body of all poses.
        poses: by frame, (n_values,) each.
        frame: a frame with a pose.
    """
    known = {i: poses[frame + i] for i in range(-2, 3) if frame + i in poses}
    if len(known) == 5:
        return np.asarray(sum(shortest_step(model, known[i + 1], known[i - 1]) for i in (-1, 0, 1)) / 6)
    before, after = (-1 if -1 in known else 0), (1 if 1 in known else 0)
    if 0 not in known or before == after:
        return None
    return shortest_step(model, known[after], known[before]) / (after - before)


def moving_bodies(
    models: Sequence[BodyModel], poses: Mapping[int, Sequence[Array]], frame: int
) -> tuple[PosedBody, ...]:
    """Return all people on a frame, with their velocities by the frames around.

    Args:
        models: the body of each person.
        poses: of all people by frame, (n_values,) each.
        frame: a frame with poses.
    """
    near = {k: poses[k] for k in (frame + n for n in NEAR) if k in poses}
    speeds = [velocity(m, {k: own[i] for k, own in near.items()}, frame) for i, m in enumerate(models)]
    return tuple(map(PosedBody, models, poses[frame], speeds))
