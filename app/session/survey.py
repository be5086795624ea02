"""Look at the calibration and footage that a user has chosen for a session, before anything is made."""

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from app.remedies import page_text
from app.session.new_session import MAX_CAMERAS, Up
from app.session.path_choice import TypedPath, TypedPaths, typed_path, typed_paths
from tracker.errors import TrackerError
from tracker.formats.anipose import CameraEntry, Units
from tracker.formats.calibrations.convention_names import PoseConvention
from tracker.formats.calibrations.reading import read_cameras
from tracker.session.footage_files import footage_in, side_parts
from tracker.session.matching import camera_name
from tracker.session.rig_summary import RigSummary, summarize_rig


class SurveyForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Paths to survey; a field that is still empty is null."""

    calibration: TypedPaths | None = None
    footage: TypedPath | None = None
    up: Up = "z"
    units: Units | None = None
    poses: PoseConvention | None = None


class Survey(msgspec.Struct, frozen=True):
    """Content of the chosen files, for the page."""

    cameras: list[str]
    """Names of the calibrated cameras."""
    footage: Annotated[list[dict[str, str]], Meta(max_length=MAX_CAMERAS)]
    """Path and name of each video or folder of images."""
    assigned: dict[str, str]
    """Path of the footage that is named after a camera, by camera."""
    rig: dict[str, Any] | None
    """Positions and directions of the cameras (`RigSummary`); null without cameras."""
    beside: dict[str, str]
    """Paths of calibration, background and masks that lie beside the footage."""
    problems: list[str]
    """Sentences on what cannot be read."""


def survey(form: SurveyForm) -> Survey:
    """Return what the chosen files hold; what cannot be read is a problem, not an error."""
    problems: list[str] = []
    entries: tuple[CameraEntry, ...] = ()
    rig: dict[str, Any] | None = None
    footage: list[Path] = []
    beside: dict[str, str] = {}
    try:
        if form.footage is not None:
            folder = typed_path(form.footage)
            footage = footage_in(folder)[:MAX_CAMERAS]
            beside = {name: str(path) for name, path in side_parts(folder)._asdict().items() if path is not None}
    except TrackerError as error:
        problems.append(page_text(error))
    by_name = {camera_name(path): str(path) for path in footage}
    try:
        if chosen := form.calibration or beside.get("calibration"):
            calibration = read_cameras(typed_paths(chosen), form.units, form.poses, by_name)
            entries = calibration.entries
            rig = _rig(summarize_rig([e.camera(e.size or _likely_size(e)) for e in entries], form.up))
            rig["doubts"] = [*calibration.notes, *rig["doubts"]]
    except TrackerError as error:
        problems.append(page_text(error))
    names = [e.name for e in entries]
    return Survey(
        names,
        [{"path": str(path), "name": path.name} for path in footage],
        {name: by_name[name] for name in names if name in by_name},
        rig,
        beside,
        problems,
    )


def _likely_size(entry: CameraEntry) -> tuple[int, int]:
    """Return the size of the pictures of a camera whose calibration states none: its principal point is the middle."""
    return max(1, round(2 * entry.K[0, 2])), max(1, round(2 * entry.K[1, 2]))


def _rig(summary: RigSummary) -> dict[str, Any]:
    """Return a summary as plain data, rounded to millimetres."""

    def plain(values: Any) -> Any:
        return None if values is None else np.round(values, 3).tolist()

    return {
        "names": summary.names,
        "centers": plain(summary.centers_world),
        "axes": plain(summary.axes_world),
        "point": plain(summary.viewed_point_world),
        "distances_m": plain(summary.distances_m),
        "heights_m": plain(summary.heights_m),
        "sentence": summary.sentence,
        "doubts": summary.doubts,
    }
