"""Read the stored poses of a session, compare them, judge imported ones, and write files.

The stored poses of one person as arrays over frames.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from tracker.api.sessions import PersonName, SessionOrFolder, frames_of, open_session, opened, people_of, person_of
from tracker.api.work import Progress, ProgressSink
from tracker.body.model import PosedBody
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.evaluation.judging import judge as judging
from tracker.evaluation.judging.judge import Judgement
from tracker.evaluation.metrics import Alignment, Evaluation
from tracker.evaluation.references import placement, read_reference
from tracker.evaluation.stored_evaluation import evaluate_stored
from tracker.formats.write_only.optional_packages import require
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.exports.export_files import check_options, for_format
from tracker.interchange.exports.export_files import export as export_motion
from tracker.interchange.exports.formats import find_format
from tracker.interchange.exports.motion import Checked, ExportOptions, read_motion
from tracker.interchange.exports.provenance import pose_arrays

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


def read_poses(session: SessionOrFolder, person: PersonName = None, frames: Sequence[int] | None = None) -> PoseSeries:
    """Read the stored poses of a person as arrays.

    Args:
        session: the session or its folder; other programs may have it open.
        person: name; needed in a session of several people.
        frames: all by default. Those without a pose are left out.

    Raises:
        SessionError: the person has no pose on these frames.
    """
    motion_of = open_session(session)
    index = person_of(motion_of, person)
    motion = read_motion(motion_of, [index], None if frames is None else frames_of(motion_of, frames))
    arrays = pose_arrays(motion, ExportOptions())
    of_person = motion.people[index]
    posed = [i for i, frame in enumerate(motion.frames) if frame in of_person.poses]
    return PoseSeries(
        person=of_person.person.name,
        frames=arrays.frames[posed],
        times_s=arrays.times_s[posed],
        bodies=tuple(of_person.poses[motion.frames[i]].body for i in posed),
        names=arrays.points,
        joints=arrays.joints[posed, 0],
        covariances=arrays.covariances[posed, 0],
        statuses=arrays.by_pose["status"][posed, 0],
        sources=arrays.by_pose["source"][posed, 0],
        keyframes=arrays.by_pose["keyframe"][posed, 0],
    )


def evaluate(
    session: SessionOrFolder,
    reference: str | Path,
    person: PersonName = None,
    frames: Sequence[int] | None = None,
    *,
    joint_map: str | Path | None = None,
    axes: str = "x,y,z",
    align: Alignment = "none",
) -> Evaluation:
    """Compare the stored poses of a person with a reference.

    Args:
        session: the session or its folder.
        reference: a TRC file, a table of poses (CSV), or the folder of another session.
        person: name; needed in a session of several people.
        frames: from the first to the last pose by default.
        joint_map: TOML file with the names of the file's joints, where they are others.
        axes: the file's axes in the session's order, such as x,-z,y.
        align: rigid-all moves the whole reference onto the estimate first.

    Raises:
        TrackerError: the reference is malformed or of other joints, or the person has no pose.
    """
    found = open_session(session)
    index, mapped = person_of(found, person), None if joint_map is None else Path(joint_map)
    known = read_reference(Path(reference), found, index, mapped, axes, placement(found))
    wanted = None if frames is None else frames_of(found, frames)
    return evaluate_stored(found, index, known, wanted, align=align, axes=axes).result


def judge(session: SessionOrFolder, observations: str, *, progress: Progress | None = None) -> list[Judgement]:
    """Judge imported observations by the footage; see docs/observations.md.

    Args:
        session: the session or its folder.
        observations: name under which they were imported.
        progress: receives the progress.

    Returns:
        A judgement of each person; `worst` lists limbs by severity.

    Raises:
        TrackerError: there are no such observations, fewer than three cameras, or tracking cannot begin.
    """
    with opened(session) as stored:
        sink = ProgressSink(progress)
        return judging.judge(stored.session, stored.observer, observations, TrackSettings(), sink, sink.report)


def export(
    session: SessionOrFolder,
    out: str | Path,
    format: str | None = None,
    people: Sequence[str] | None = None,
    frames: Sequence[int] | None = None,
    *,
    only: Literal["keyframes", "reviewed"] | None = None,
    skip_lost: bool = False,
    overwrite: bool = False,
    options: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write stored poses to files of another program; docs/export.md describes each format.

    Args:
        session: the session or its folder.
        out: the file or folder to write; with several files, their names are made from this one.
        format: name of the format; by default as `out` ends.
        people: names; all by default.
        frames: from the first to the last pose by default.
        only: leave out poses that nobody set or verified, or that nobody reviewed.
        skip_lost: treat poses whose status is lost as missing.
        overwrite: replace files that exist.
        options: of the format by name, such as axes or units.

    Returns:
        The files, which appear complete, or none.

    Raises:
        TrackerError: there is nothing to export, an option is wrong, or a file exists.
    """
    found, path = open_session(session), Path(out)
    chosen = find_format(format, path)
    given = check_options(chosen, found, dict(options or {}))
    checked: Checked | None = only
    wanted = None if frames is None else frames_of(found, frames)
    motion = for_format(chosen, read_motion(found, people_of(found, people), wanted, skip_lost, checked))
    return export_motion(chosen, motion, given, path, overwrite)
