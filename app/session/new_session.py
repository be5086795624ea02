"""Make a session of what a user has entered in the page.

Look at the calibration and footage that a user has chosen for a session, before anything is made.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from app.remedies import page_text
from app.session.camera_check import exchange_of
from app.session.path_choice import TypedPath, TypedPaths, typed_path, typed_paths
from tracker.errors import SessionError, TrackerError
from tracker.formats.anipose import CameraEntry, Units
from tracker.formats.calibrations.convention_names import PoseConvention
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry.lengths import height_m
from tracker.session.assemble import DEFAULT_MODEL, NewSession, SessionParts, check_parts
from tracker.session.footage_files import footage_in, side_parts
from tracker.session.matching import camera_name
from tracker.session.rig_summary import RigSummary, summarize_rig
from tracker.validation import FrameRate, Name

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
MAX_CAMERAS = 1000
Report = Callable[[str, Any], None]
"""Takes the kind of a line, and its text or data."""

_Height = Annotated[float, Meta(gt=0, le=1000, title="Height", description="a height such as 1.78 or 178")]
_Offset = Annotated[float, Meta(ge=-10_000_000, le=10_000_000, title="Offset", description="a number of frames")]


class CameraChoice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choices of a user for one calibrated camera."""

    name: Name
    footage: TypedPath
    """Its video or folder of images."""
    side_name: Name | None = None
    """Name after which its background and masks are filed; null for its own."""
    offset: _Offset | None = None
    """Frame k of the session is frame k + offset of the camera; it may have a fraction. None leaves it to clocks."""


class NewSessionForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parts of a new session, as a user types them."""

    folder: TypedPath
    """Folder to make."""
    calibration: TypedPaths
    """File of the cameras, folder with a file for each, or these files."""
    footage: TypedPath
    """Folder with a video or a folder of images for each camera."""
    people: Annotated[list[Name], Meta(min_length=1, max_length=20, title="People", description="1 to 20 names")]
    cameras: Annotated[list[CameraChoice], Meta(max_length=MAX_CAMERAS)] = []
    """Cameras to use, with their footage; empty to match the footage to the cameras by its names."""
    heights: Annotated[list[_Height], Meta(max_length=20, title="Height", description="at most 20 heights")] = []
    """Body heights, m or cm: one for all people, or one for each in their order; empty for that of the body model."""
    models: Annotated[
        list[TypedPath], Meta(max_length=20, title="Body model", description="at most 20 body models")
    ] = []
    """Presets or .toml files of bodies: one for all people, or one for each in their order; empty for the default."""
    up: Up = "z"
    """World axis that points up."""
    units: Units | None = None
    """Unit of the calibration's translations; null for the one that its layout fixes, else metres."""
    poses: PoseConvention | None = None
    """Convention of the calibration's poses; null for that of its layout."""
    rescale: bool = False
    """Whether a calibration at a whole multiple of the footage's size is scaled to it."""
    fps: Annotated[FrameRate, Meta(title="Frame rate")] | None = None
    """Rate at which the cameras filmed, if the videos declare another one or all footage is images."""
    common_frames: bool = False
    """Whether frames that only some cameras have are left out: at the end, of numbered images at both ends."""
    background: TypedPath | None = None
    """Folder with an image or video of the empty scene for each camera."""
    masks: TypedPath | None = None
    """Folder with a folder of masks for each camera."""
    keep_assignment: bool = False
    """Whether the footage stays as assigned even if two cameras seem to be exchanged."""


def make_session(form: NewSessionForm, report: Report) -> None:
    """Make a session folder. Nothing is written unless all of it fits and no two cameras seem to be exchanged.

    Args:
        form: what to make it of.
        report: called with `passed` or `warning` and a sentence; at the end with `failed` and a sentence, `exchanged`
            and two cameras that seem to be, or `made` and the folder.
    """
    try:
        parts = check_parts(_request(form), lambda text: report("passed", text), lambda text: report("warning", text))
        if _is_refused(form, parts, report):
            return
        made = parts.make()
    except TrackerError as error:
        report("failed", page_text(error))
        return
    report("made", str(made.folder))


def _is_refused(form: NewSessionForm, parts: SessionParts, report: Report) -> bool:
    """Check that no two cameras are exchanged; report it. Returns whether the user has to decide first."""
    found = exchange_of(parts.cameras)
    if found is None:
        report("passed", "No two cameras seem to be exchanged.")
        return False
    if form.keep_assignment:
        report("warning", found.text)
        return False
    report("exchanged", {"cameras": found.cameras, "with_backgrounds": found.with_backgrounds, "text": found.text})
    return True


def _request(form: NewSessionForm) -> NewSession:
    cameras = {c.name: typed_path(c.footage) for c in form.cameras}
    return NewSession(
        typed_path(form.folder),
        calibration=typed_paths(form.calibration),
        videos=() if cameras else footage_in(typed_path(form.footage)),
        camera_paths=cameras,
        cameras=tuple(c.name for c in form.cameras),
        background=None if form.background is None else typed_path(form.background),
        masks=None if form.masks is None else typed_path(form.masks),
        side_names={c.name: c.side_name for c in form.cameras if c.side_name is not None},
        offsets={c.name: c.offset for c in form.cameras if c.offset is not None},
        people=tuple(form.people),
        models=_of_each(form, "body model", [_model(m) for m in form.models]) or DEFAULT_MODEL,
        heights=_of_each(form, "height", [height_m(h) for h in form.heights]),
        fps=form.fps,
        common_frames=form.common_frames,
        up=form.up,
        units=form.units,
        poses=form.poses,
        rescale=form.rescale,
    )


def _model(text: str) -> str:
    return str(typed_path(text)) if text.endswith(".toml") else text


def _of_each(form: NewSessionForm, what: str, values: list[Any]) -> Any:
    """Return the value for all people, or those of each by name; None without any.

    Raises:
        SessionError: there are several, but not one for each.
    """
    if len(values) not in (0, 1, len(form.people)):
        raise SessionError(
            f"expected one {what} for all, or one for each of {len(form.people)} people, found {len(values)}; "
            "separate them by commas, in the order of the names"
        )
    if len(values) > 1:
        return dict(zip(form.people, values, strict=True))
    return values[0] if values else None


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
