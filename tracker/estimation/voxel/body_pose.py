"""Turn poses of a session's body into filter states, and states back into poses."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.gauss_newton import (
    CLOSE_ENOUGH,
    OTHER_BODY_M,
    UNKNOWN,
    PointTargets,
    PosePrior,
    ResidualBlock,
    covariance,
    solve,
)
from tracker.estimation.voxel.figure import (
    N_PARTS,
    figure_of,
    part_rotations,
    point_shares,
    torso_center,
    with_shoulders_of,
)
from tracker.estimation.voxel.kalman import product
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.estimation.voxel.state import FilterState, Layout, point_jacobians
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

_START_VELOCITY = 5.0
"""Standard deviation of a velocity before the first frame, rad/s or m/s. With 2 rad/s and 0.5 m/s, the tracker is off
by 43.9 mm on `walk`, with this by 43.6."""


class BodyPose(NamedTuple):
    """The pose of a body that stands for a state."""

    values: Array
    """(n_values,)."""
    covariance: Array
    """(n_dofs, n_dofs), rad and metres."""


def state_of(model: BodyModel, past: Sequence[Array], dt: float, settings: VoxelSettings) -> FilterState:
    """Return the state of a person in a pose.

    Args:
        model: the body.
        past: poses of the last frames, (n_values,) each, the present one last.
        dt: time between them, s.
        settings: of the tracker.
    """
    of = figure_of(model)
    layout = Layout(settings.sizes != "frozen", True, settings.turn_rates)
    body = PosedBody(model, past[-1])
    rotations = part_rotations(body, of)
    center = torso_center(body, of, rotations[0])
    velocity, rates = np.zeros(3), np.zeros((N_PARTS, 3))
    if len(past) > 1:
        before = PosedBody(model, past[-2])
        turned = part_rotations(before, of)
        velocity = (center - torso_center(before, of, turned[0])) / dt
        if settings.turn_rates:
            rates = rigid.so3_log(np.swapaxes(turned, 1, 2) @ rotations) / dt
    variances = np.empty(layout.n)
    variances[layout.turns_at] = settings.start_turn**2
    variances[layout.center_at] = settings.start_m**2
    variances[layout.sizes_at] = settings.start_size_m**2
    variances[layout.velocity_at] = _START_VELOCITY**2
    variances[layout.turn_rates_at] = _START_VELOCITY**2
    return FilterState(
        with_shoulders_of(of, body, rotations[0], center), layout, rigid.quaternion_from_matrix(rotations),
        of.sizes.copy(), center, velocity, rates, np.diag(variances),
    )  # fmt: skip


def pose_of(
    model: BodyModel,
    state: FilterState,
    near: Array,
    active_dofs: NDArray[np.bool_] | None = None,
    start: Array | None = None,
) -> BodyPose:
    """Return the pose of a body that comes closest to the joints of a state, within the limits of the body.

    Each joint counts by its own covariance. Degrees of freedom that joints do not determine stay near another pose.

    Args:
        model: the body.
        state: of the filter.
        near: the other pose, (n_values,).
        active_dofs: degrees of freedom that may move, (n_dofs,); None: all.
        start: initial pose, (n_values,); by default the other pose.
    """
    points = point_shares(state.figure)
    names = {n: i for i, n in enumerate(model.point_names)}
    arms = points.shares * state.sizes[points.parts]
    targets = state.centers[points.parts] + (state.rotations[points.parts] @ arms[..., None])[..., 0]
    J = point_jacobians(state, points.parts, points.shares)
    JP = product(J.reshape(-1, state.layout.n), state.covariance).reshape(J.shape)
    variances = np.einsum("pij,pij->p", JP, J) / 3
    blocks: list[ResidualBlock] = [
        PointTargets(np.array([names[n] for n in points.names]), targets, 1 / np.sqrt(variances + OTHER_BODY_M**2)),
        PosePrior.of_spreads(model),
        PosePrior(near, np.full(model.n_dofs, 1 / UNKNOWN)),
    ]
    fit = solve(model, near if start is None else start, blocks, active_dofs, tolerance=CLOSE_ENOUGH)
    return BodyPose(fit.pose, covariance(model, fit))
