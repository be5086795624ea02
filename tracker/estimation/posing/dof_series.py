"""Change degrees of freedom of poses over time: steps within the joint limits, and a low-pass filter."""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.posing.edits import copy_dofs
from tracker.geometry.arrays import Array

_ORDER = 2
"""Order of the Butterworth filter: forward and backward it is the fourth-order filter without lag of Winter 2009."""


def move_dofs(model: BodyModel, poses: Array, dofs: Sequence[int], steps: Array | float) -> Array:
    """Move degrees of freedom of poses within the joint limits; all others stay.

    Args:
        model: the body.
        poses: (n, n_values).
        dofs: indices of the degrees of freedom; of a ball joint, components of the rotation vector from neutral.
        steps: added to them, rad or metres; broadcasts to (n, n of `dofs`).

    Returns:
        The poses, (n, n_values).
    """
    values, chosen = _dof_values(model, poses), np.isin(np.arange(model.n_dofs), dofs)
    values[:, list(dofs)] += steps
    moved = model.move(model.neutral(), values)
    return np.stack([copy_dofs(model, *pair, chosen) for pair in zip(poses, moved, strict=True)])


def smooth_dofs(model: BodyModel, poses: Array, dofs: Sequence[int], fps: float, cutoff_hz: float) -> Array:
    """Smooth degrees of freedom of poses on successive frames by a Butterworth filter without lag.

    D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009: the filter runs forward and backward,
    each time with a higher cutoff, so that both together have the one that is asked for. Beyond the ends the curve is
    turned about its last point, for one period of the cutoff.

    Args:
        model: the body.
        poses: (n, n_values), one for each frame.
        dofs: as for `move_dofs`.
        fps: frame rate, 1/s.
        cutoff_hz: frequency of which the filter leaves half the power.

    Returns:
        The poses, (n, n_values), within the joint limits.

    Raises:
        TrackerError: the cutoff is not below half the frame rate.
    """
    from scipy.signal import butter, sosfiltfilt  # imported lazily: takes 0.5 s to load

    if not 0.0 < cutoff_hz < fps / 2:
        raise TrackerError(
            f"expected a cutoff above 0 and below {fps / 2:g} Hz, half the frame rate, found {cutoff_hz:g} Hz; "
            "choose another"
        )
    passes = (np.sqrt(2.0) - 1.0) ** (1 / (2 * _ORDER))
    single_hz = fps / np.pi * np.arctan(np.tan(np.pi * cutoff_hz / fps) / passes)
    values = _dof_values(model, poses)[:, list(dofs)]
    values = np.where(model.dof_is_length[list(dofs)], values, np.unwrap(values, axis=0))
    sections = butter(_ORDER, single_hz, output="sos", fs=fps)
    filtered = sosfiltfilt(sections, values, axis=0, padlen=min(len(values) - 1, round(fps / cutoff_hz)))
    return move_dofs(model, poses, dofs, filtered - values)


def _dof_values(model: BodyModel, poses: Array) -> Array:
    """Return poses, (n, n_values), by their degrees of freedom from the neutral pose, (n, n_dofs), rad and metres."""
    return np.stack([model.difference(pose, model.neutral()) for pose in poses])
