"""Datasets of `movement` as netCDF: poses over time, with coordinates that xarray reads.

A dataset has the variables `position` (time, space, keypoints, individuals) and `confidence` (time, keypoints,
individuals); one of several views has a dimension `view` before these.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.formats.write_only.optional_packages import require
from tracker.geometry.arrays import Array

Variable = tuple[tuple[str, ...], NDArray[Any]]
"""Names of the dimensions of a variable, and its values."""
PER_POSE = ("time", "individuals")
"""Dimensions of a value of each pose."""
PER_POINT = ("time", "keypoints", "individuals")
"""Dimensions of a value of each point."""


class PoseDataset(NamedTuple):
    """Poses of P people with n points on F frames."""

    position: Array
    """(F, P, n, D), or (V, F, P, n, D) in V views; D is 2 or 3."""
    confidence: Array
    """(F, P, n), or (V, F, P, n), from 0 to 1; NaN without a point."""
    times_s: Array
    """(F,)."""
    individuals: Sequence[str]
    """Names of the people, (P,)."""
    keypoints: Sequence[str]
    """Names of the points, (n,)."""
    views: Sequence[str] = ()
    """Names of the views, (V,); none for points in space."""


def write_dataset(
    path: Path, poses: PoseDataset, attributes: Mapping[str, Any], variables: Mapping[str, Variable]
) -> None:
    """Write a dataset of poses.

    Args:
        path: the file.
        poses: as arrays.
        attributes: of the dataset, besides those of the poses: at least `fps`.
        variables: more of them by name.

    Raises:
        FormatError: a package is missing.
    """
    require("h5netcdf", "netCDF")
    xarray = require("xarray", "netCDF")
    view = ("view",) * bool(poses.views)
    n_space = poses.position.shape[-1]
    variables = {
        "position": ((*view, "time", "space", "keypoints", "individuals"), _last_people(poses.position, 2)),
        "confidence": ((*view, *PER_POINT), _last_people(poses.confidence, 1)),
        **variables,
    }
    coordinates = {
        "time": poses.times_s,
        "space": list("xyz"[:n_space]),
        "keypoints": list(poses.keypoints),
        "individuals": list(poses.individuals),
        **({"view": list(poses.views)} if poses.views else {}),
    }
    common = {"source_software": "Quadrille", "ds_type": "poses", "time_unit": "seconds"}
    dataset = xarray.Dataset(variables, coords=coordinates, attrs=common | dict(attributes))
    dataset.to_netcdf(path, engine="h5netcdf")


def per_point(values: NDArray[Any]) -> Variable:
    """Return values of each point, (F, P, n), or (V, F, P, n) in V views, as a variable."""
    return (("view",) * (values.ndim == 4) + PER_POINT, _last_people(values, 1))


def _last_people(values: NDArray[Any], n_after: int) -> NDArray[Any]:
    """Bring the people to the end, and of positions the coordinates before the points.

    Args:
        values: (..., F, P, n) or (..., F, P, n, D).
        n_after: number of dimensions after the people: 1 or 2.
    """
    if n_after == 1:
        return np.swapaxes(values, -1, -2)
    return np.moveaxis(values, (-1, -2, -3), (-3, -2, -1))
