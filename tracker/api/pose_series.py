"""The stored poses of one person as arrays over frames."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.formats.write_only.optional_packages import require
from tracker.geometry.arrays import Array, IntArray

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, eq=False)
class PoseSeries:
    """The poses of one person on F frames, of n joints and other named points."""

    person: str
    frames: IntArray
    """Frames with a pose, (F,), ascending."""
    times_s: Array
    """Their times, (F,)."""
    bodies: tuple[PosedBody, ...]
    """The body in each pose, (F,); sizes may change between them."""
    names: tuple[str, ...]
    """Of the joints and points, (n,)."""
    joints: Array
    """Positions in the world, (F, n, 3), metres; NaN for points that a body lacks."""
    covariances: Array
    """Of the positions in the world, (F, n, 3, 3), m^2; NaN where not known."""
    statuses: NDArray[np.str_]
    """good, doubtful, lost, or empty where not assessed, (F,)."""
    sources: NDArray[np.str_]
    """How each pose was made, such as hand or tracked, (F,)."""
    keyframes: NDArray[np.bool_]
    """Whether a person set or verified it, (F,)."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.frames)

    def joint(self, name: str) -> Array:
        """Return the positions of a joint, (F, 3), metres.

        Raises:
            KeyError: no body has a joint of this name.
        """
        if name not in self.names:
            raise KeyError(f"expected a joint among {', '.join(self.names)}, found '{name}'")
        return self.joints[:, self.names.index(name)]

    def errors_m(self, name: str) -> Array:
        """Return the root mean square error of a joint, (F,), metres; NaN where not known.

        Raises:
            KeyError: no body has a joint of this name.
        """
        self.joint(name)
        return np.asarray(np.sqrt(np.trace(self.covariances[:, self.names.index(name)], axis1=-2, axis2=-1)))

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a table with a row for each frame and joint: where it is and its expected error, metres.

        Raises:
            FormatError: pandas is not installed.
        """
        pandas = require("pandas", "a table of pandas", "make")
        n_frames, n_joints = self.joints.shape[:2]
        each = {
            "frame": self.frames,
            "time_s": self.times_s,
            "status": self.statuses,
            "source": self.sources,
            "keyframe": self.keyframes,
        }
        columns = {name: np.repeat(values, n_joints) for name, values in each.items()}
        places = {f"{axis}_m": self.joints[..., i].ravel() for i, axis in enumerate("xyz")}
        errors = np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)).ravel()
        return pandas.DataFrame({"joint": np.tile(self.names, n_frames), **columns, **places, "error_m": errors})

    def to_xarray(self) -> "xarray.Dataset":
        """Return positions, metres, and covariances, m^2, over time, joint and axis.

        Raises:
            FormatError: xarray is not installed.
        """
        xarray = require("xarray", "a dataset of xarray", "make")
        of_frames = {
            "frame": self.frames, "status": self.statuses, "source": self.sources, "keyframe": self.keyframes,
        }  # fmt: skip
        return xarray.Dataset(
            {
                "position": (("time", "joint", "axis"), self.joints, {"units": "m"}),
                "covariance": (("time", "joint", "axis", "axis_2"), self.covariances, {"units": "m2"}),
            },
            {
                "time": self.times_s, "joint": list(self.names), "axis": list("xyz"), "axis_2": list("xyz"),
                **{name: ("time", values) for name, values in of_frames.items()},
            },
            {"person": self.person},
        )  # fmt: skip
