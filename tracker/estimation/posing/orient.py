"""Turn one part of a body to a target orientation by the degrees of freedom of its own joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import NormalEquations, normal_equations, solve
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class _OrientationTarget:
    """Residuals between the axes of a part and target directions; see `ResidualBlock`."""

    part: int
    R_world_target: Array
    """Target orientation, (3, 3)."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        R = kinematics.Ts_world_part[self.part, :3, :3]
        turns = np.where(model.dof_is_length[:, None], 0.0, kinematics.axes_world)
        turns = turns * model.moves[:, [self.part]]
        # A turn about a moves the axes of the part, the columns of R, by a x R.
        J = np.cross(turns[:, None, :], R.T[None])  # (n_dofs, axis, 3)
        return normal_equations((R - self.R_world_target).T.ravel(), J.reshape(model.n_dofs, 9).T)


def orient(
    model: BodyModel, pose: Array, part: int, R_world_target: Array, active_dofs: NDArray[np.bool_] | None = None
) -> Array:
    """Turn a part as near to a target orientation as its own joint allows; all other joints stay.

    Args:
        model: the body.
        pose: its pose, (n_values,).
        part: index of the part, and of the joint that moves it.
        R_world_target: orientation of the part's frame, (3, 3).
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Returns:
        The new pose, (n_values,), within the joint limits.
    """
    own = (model.dof_joint == part) & ~model.dof_is_length
    own = own if active_dofs is None else own & active_dofs
    if not np.any(own):
        return np.array(pose)
    return solve(model, pose, [_OrientationTarget(part, R_world_target)], active_dofs=own).pose
