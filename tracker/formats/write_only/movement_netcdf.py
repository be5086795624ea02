"""Datasets of `movement` as netCDF: poses over time, with coordinates that xarray reads.

A dataset has the variables `position` (time, space, keypoints, individuals) and `confidence` (time, keypoints,
individuals); one of several views has a dimension `view` before these.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import NDArray

from tracker.formats.write_only.optional_packages import require

Variable: TypeAlias = tuple[tuple[str, ...], NDArray[Any]]
"""Names of the dimensions of a variable, in any order, and its values."""
PER_POINT = ("time", "individuals", "keypoints")
"""Dimensions of a value of each point."""
PER_POSE = PER_POINT[:2]
"""Dimensions of a value of each pose."""
_ORDER = ("view", "time", "space", "space_of", "keypoints", "individuals")


def write_dataset(
    path: Path,
    variables: Mapping[str, Variable],
    coordinates: Mapping[str, Sequence[str] | NDArray[Any]],
    attributes: Mapping[str, Any],
) -> None:
    """Write a dataset of poses.

    Args:
        path: the file.
        variables: by name, at least `position`, whose values are NaN where missing, and `confidence`, from 0 to 1.
        coordinates: of the dimensions: times in s, and names.
        attributes: of the dataset, besides those of all: at least `fps`.

    Raises:
        FormatError: a package is missing.
    """
    require("h5netcdf", "netCDF")
    xarray = require("xarray", "netCDF")
    common = {"source_software": "Quadrille", "ds_type": "poses", "time_unit": "seconds"}
    dataset = xarray.Dataset(dict(variables), coords=dict(coordinates), attrs=common | dict(attributes))
    dataset.transpose(*_ORDER, missing_dims="ignore").to_netcdf(path, engine="h5netcdf")
