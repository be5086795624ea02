"""Fit a rough pose incrementally: the root first, then the trunk, then limb by limb, then all (KRH08 Sect. 6)."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, TOLERANCE
from tracker.estimation.fitting.gauss_newton import Fit, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.geometry.arrays import Array


class FitStep(NamedTuple):
    """A step of an incremental fit."""

    name: str
    """Name of the chain that moved: "root", "trunk", "left arm", ..., "whole body"."""
    fit: Fit
    """The pose after the step."""


def fit_by_chains(
    model: BodyModel, pose: Array, blocks: Sequence[ResidualBlock], active_dofs: NDArray[np.bool_] | None = None
) -> Iterator[FitStep]:
    """Fit a pose step by step, each step with the chains before it where they were found.

    Args:
        model: the body.
        pose: the rough guess, (n_values,).
        blocks: the residual blocks.
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Yields:
        The steps. The last moves all degrees of freedom.
    """
    is_active = np.ones(model.n_dofs, dtype=bool) if active_dofs is None else active_dofs
    for name, dofs in fit_chains(model):
        if not (dofs & is_active).any():
            continue
        fit = solve_compiled_or_plain(model, pose, blocks, dofs & is_active, MAX_ITERATIONS, TOLERANCE)
        pose = fit.pose
        yield FitStep(name, fit)


def fit_chains(model: BodyModel) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return the names and degrees of freedom, (n_dofs,), of the steps of an incremental fit."""
    is_root, all_limbs = model.dof_joint == 0, limbs(model)
    of_limbs = np.any([limb.dofs for limb in all_limbs], axis=0) if all_limbs else np.zeros(model.n_dofs, dtype=bool)
    trunk = ~is_root & ~of_limbs
    each = [(limb_display_name(limb.name), limb.dofs) for limb in all_limbs]
    return [("root", is_root), ("trunk", trunk), *each, ("whole body", np.ones(model.n_dofs, dtype=bool))]
