"""Convert degrees of freedom to the units that people read and type: degrees and centimetres."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limb_display_name
from tracker.body.model import BodyModel
from tracker.estimation.posing.edits import joint_of, limb_of
from tracker.geometry.arrays import Array


def factors(model: BodyModel) -> Array:
    """Return the factors from radians and metres to degrees and centimetres, (n_dofs,)."""
    return np.where(model.dof_is_length, 100.0, np.degrees(1.0))


def shown(model: BodyModel, values: Array) -> list[float]:
    """Return a pose in degrees and centimetres. Angles without limits are wrapped to [-180, 180)."""
    numbers = model.difference(values, model.neutral())
    is_cyclic = ~model.dof_is_length & np.isinf(model.limits).any(axis=1)
    numbers = np.where(is_cyclic, np.remainder(numbers + np.pi, 2 * np.pi) - np.pi, numbers)
    return [round(float(n), 3) for n in numbers * factors(model)]


def described(model: BodyModel) -> dict[str, Any]:
    """Describe the degrees of freedom, with the fields of `PersonInfo` (docs/protocol.md)."""
    limits = model.limits * factors(model)[:, None]
    of_points = {p: model.dof_joint == joint_of(model, p) for p in model.point_names}
    limbs = {p: limb_of(model, p) for p in model.point_names}
    return {
        "dofs": [
            {
                "joint": model.joints[model.dof_joint[i]].name,
                "name": name.partition(".")[2],
                "unit": "cm" if model.dof_is_length[i] else "deg",
                "low": _limit(limits[i, 0]),
                "high": _limit(limits[i, 1]),
            }
            for i, name in enumerate(model.dof_names)
        ],
        "point_dofs": {p: _indices(dofs) for p, dofs in of_points.items()},
        "point_limbs": {
            p: {"name": limb_display_name(name), "dofs": _indices(dofs)} for p, (name, dofs) in limbs.items()
        },
    }


def _limit(value: float) -> float | None:
    return round(float(value), 3) if np.isfinite(value) else None


def _indices(dofs: NDArray[np.bool_]) -> list[int]:
    return [int(i) for i in np.flatnonzero(dofs)]
