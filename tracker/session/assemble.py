"""Make a session from a calibration and loose footage: match them, and check that they fit together."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from tracker.body.dimensions import STATED_HEIGHT_SIGMA
from tracker.errors import RecordingError, Remedy, SessionError
from tracker.footage.camera_source import CameraSource, whole_frames
from tracker.footage.frame_rates import same_rate
from tracker.footage.recording import check_size
from tracker.footage.video import Footage, open_footage
from tracker.formats.anipose import CameraEntry, Units
from tracker.formats.calibrations.convention_names import PoseConvention
from tracker.formats.calibrations.reading import CalibratedCameras, read_cameras
from tracker.formats.model_toml import load_model
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import UP_ROTATIONS
from tracker.geometry.lengths import check_heights
from tracker.session.footage_clocks import (
    ClockStarts,
    check_chapters,
    clock_notes,
    disagreement,
    find_clock_starts,
    find_name_starts,
    sound_disagreement,
)
from tracker.session.footage_files import check_side_files, find_background, find_masks
from tracker.session.matching import (
    camera_name,
    check_image_numbers,
    check_names,
    common_length,
    common_offsets,
    common_rate,
    footage_notes,
    match_footage,
    shared_footage,
)
from tracker.session.rig_summary import check_shared_view, summarize_rig
from tracker.session.session import PALETTE, Person, Session, check_content, create_session
from tracker.validation import nfc_name

T = TypeVar("T")

DEFAULT_MODEL = "gavrila38"


@dataclass(frozen=True)
class NewSession:
    """A request for a new session."""

    folder: Path
    """Folder of the session; must not exist, or be empty."""
    calibration: Path | Sequence[Path]
    """A file or folder, or a file for each camera (`tracker.formats.calibrations`)."""
    videos: Sequence[Path] = ()
    """Video files or image folders, each named after its camera."""
    camera_paths: Mapping[str, Path] = field(default_factory=dict)
    """Footage by camera name, under any file name; goes before `videos`."""
    cameras: Sequence[str] = ()
    """Names of the calibrated cameras to use, in the session's order; all that have footage if empty."""
    background: Path | None = None
    """Folder of CAM.png or CAM.mp4 of the empty scene."""
    masks: Path | None = None
    """Folder of CAM/%06d.png."""
    side_names: Mapping[str, str] = field(default_factory=dict)
    """Name after which the background and masks of a camera are filed, by camera; its own for cameras left out."""
    offsets: Mapping[str, float] = field(default_factory=dict)
    """Shift by camera name: frame k of the session is frame k + offset of the camera. The nearest whole frame is shown;
    the rest goes into the camera's clock."""
    people: Sequence[str] = ("person",)
    """Names of the people to track."""
    models: Mapping[str, str] | str = DEFAULT_MODEL
    """Body model (preset or .toml file) of all people, or by name; the default for names left out."""
    heights: Mapping[str, float] | float | None = None
    """Body height of all people, or by name, metres; the model's own for names left out."""
    fps: float | None = None
    """Frame rate at which the cameras filmed, 1/s; overrides the rate that the videos declare. Needed if all footage is
    folders of images."""
    up: str = "z"
    """World axis that points up."""
    common_frames: bool = False
    """Whether frames that only some cameras have are left out: at the end, of numbered images at both ends."""
    units: Units | None = None
    """Unit of the calibration's translations; by default the one that its layout fixes, else metres."""
    poses: PoseConvention | None = None
    """Convention of the calibration's poses; by default that of its layout, unless the cameras contradict it."""
    rescale: bool = False
    """Whether a calibration at a whole multiple of the footage's size is scaled to it."""
    any_size: bool = False
    """Whether unusual sizes of rooms, people and focal lengths, and cameras without a shared view, are taken."""


@dataclass(frozen=True)
class SessionParts:
    """Checked parts of a session, which fit together."""

    request: NewSession
    cameras: tuple[CameraSource, ...]
    people: tuple[Person, ...]
    fps: float
    """Frames per second."""
    n_frames: int

    @property
    def session(self) -> Session:
        """The session that they make, which is not written."""
        folder = self.request.folder
        return Session(folder, folder.name, self.fps, self.n_frames, self.cameras, self.people, self.request.up)

    def make(self) -> Session:
        """Make the session folder.

        Raises:
            SessionError: the folder is not empty, or cannot be written.
        """
        return create_session(
            self.request.folder, cameras=self.cameras, people=self.people, fps=self.fps, n_frames=self.n_frames,
            up=self.request.up,
        )  # fmt: skip


def assemble(
    request: NewSession, report: Callable[[str], None] = lambda _: None, note: Callable[[str], None] | None = None
) -> Session:
    """Make a session folder of a calibration and footage. Nothing is written unless all of it fits.

    Args:
        request: what to make it of.
        report: called with a sentence after each check that has passed.
        note: called with each sentence on what may be wrong, such as a camera without a pose; `report` by default.

    Raises:
        TrackerError: as `check_parts` and `SessionParts.make` do.
    """
    return check_parts(request, report, note).make()


def _check_choice(request: NewSession, calibration: CalibratedCameras) -> None:
    """Check that the cameras that are asked for are calibrated, each once.

    Raises:
        SessionError: one is not, or is named twice.
    """
    for name in (*request.cameras, *request.camera_paths):
        if name in calibration.left_out:
            raise SessionError(
                f"camera '{name}' is asked for, but {calibration.left_out[name]}; calibrate it with the others, or "
                "leave it out"
            )
    calibrated = [c.name for c in calibration.entries]
    if len(calibrated) == 1 and len(request.videos) > 1 and not request.cameras:
        raise SessionError(
            f"the calibration has the camera '{calibrated[0]}' alone, and there are {len(request.videos)} "
            "videos; give the files of all cameras or their folder, or one calibration of all"
        )
    check_names(request.cameras, calibrated, "camera", "the cameras to use")
    if twice := [n for n in request.cameras if request.cameras.count(n) > 1]:
        raise SessionError(f"expected each camera to use once, found '{twice[0]}' twice; leave one out")


def check_parts(
    request: NewSession, report: Callable[[str], None] = lambda _: None, note: Callable[[str], None] | None = None
) -> SessionParts:
    """Check that a calibration and footage fit together, and write nothing.

    Args:
        request: what a session is to be made of.
        report: called with a sentence after each check that has passed.
        note: called with each sentence on what may be wrong; `report` by default.

    Raises:
        SessionError: an unknown name, a camera without footage or footage without a camera.
        RecordingError: footage that is unreadable, or does not fit the calibration or the other cameras.
        CalibrationError: the calibration is malformed.
        ModelError: a body model is unknown or malformed.
    """
    request = _with_compared_names(request)
    note = note or report
    calibration = _read_calibration(request)
    calibrated = {c.name: c for c in calibration.entries}
    for sentence in calibration.notes:
        note(sentence)
    _check_choice(request, calibration)
    without = [] if request.cameras else unfilmed_cameras(request, list(calibrated))
    names = list(request.cameras) or [n for n in calibrated if n not in without]
    report(f"The calibration has {len(calibrated)} cameras: {', '.join(calibrated)}.")
    if without:
        report(f"Cameras without footage are left out: {', '.join(without)}.")
    unused = (calibrated.keys() | calibration.left_out.keys()) - set(names)
    check_names(request.offsets, names, "camera", "the offsets")
    paths = match_footage(names, request.videos, request.camera_paths, unused)
    report("Each camera has footage: " + ", ".join(f"{name} ({paths[name].name})" for name in names) + ".")
    footage = {name: open_footage(paths[name], name) for name in names}
    try:
        cameras = {name: _fitted(calibrated[name], footage[name], request.rescale) for name in names}
        report("All footage can be read and has the calibrated shape.")
        fps = common_rate(footage, request.fps)
        chapters = check_chapters(footage)
        clocks, sentences = _clocks(request, footage, fps)
        if clocks is not None:
            request = replace(request, offsets=clocks.starts, common_frames=True)
        whole = {name: whole_frames(start) for name, start in request.offsets.items()}
        check_image_numbers(footage, whole, request.common_frames)
        if request.common_frames:
            whole = common_offsets(footage, whole)
            request = replace(request, offsets={**whole, **request.offsets})
        n_frames = common_length(footage, whole, request.common_frames)
        report(f"All cameras have {n_frames} frames at {fps:g} per second.")
        lost = {} if clocks is None else clocks.lost
        sources = tuple(
            _source(request, cameras[name], footage[name], fps, n_frames).with_lost_in_footage(lost.get(name, ()))
            for name in names
        )
        left_out = _left_out(sources, n_frames)
        shared = shared_footage(paths)
        for sentence in (*shared, *chapters, *sentences, *left_out, *footage_notes(footage, fps, whole)):
            note(sentence)
    finally:
        for f in footage.values():
            f.close()
    for source in sources:
        check_side_files(source)
    if not request.any_size:
        check_heights(request.heights, SessionError)
        check_shared_view(list(cameras.values()))
    people = _make_people(request.people, request.models, request.heights)
    report("The body models fit: " + ", ".join(f"{p.name} {p.model.height_m:.2f} m" for p in people) + ".")
    if request.up in UP_ROTATIONS:
        rig = summarize_rig(list(cameras.values()), request.up)
        report(rig.sentence)
        for sentence in rig.doubts:
            note(sentence)
    parts = SessionParts(request, sources, people, fps, n_frames)
    check_content(parts.session)
    return parts


def unfilmed_cameras(request: NewSession, calibrated: Sequence[str] | None = None) -> list[str]:
    """Return the calibrated cameras that a request gives no footage; none if it gives no calibrated camera any.

    Args:
        request: of a new session.
        calibrated: names of the calibrated cameras; read from the request's calibration by default.

    Raises:
        CalibrationError: the calibration is malformed.
    """
    if calibrated is None:
        calibrated = [c.name for c in _read_calibration(request).entries]
    filmed = _filmed(request)
    missing = [n for n in calibrated if n not in filmed]
    return missing if len(missing) < len(calibrated) else []


def _read_calibration(request: NewSession) -> CalibratedCameras:
    return read_cameras(request.calibration, request.units, request.poses, _filmed(request), request.any_size)


def _filmed(request: NewSession) -> set[str]:
    """Return the names of the cameras that have footage."""
    return {*map(nfc_name, request.camera_paths), *map(camera_name, request.videos)}


def _with_compared_names(request: NewSession) -> NewSession:
    """Return a request whose names have the Unicode form in which they are compared."""

    def keys(values: Mapping[str, T]) -> dict[str, T]:
        return {nfc_name(name): value for name, value in values.items()}

    models, heights = request.models, request.heights
    return replace(
        request,
        videos=tuple(request.videos),
        camera_paths=keys(request.camera_paths),
        cameras=tuple(map(nfc_name, request.cameras)),
        offsets=keys(request.offsets),
        side_names=keys(request.side_names),
        people=tuple(map(nfc_name, request.people)),
        models=keys(models) if isinstance(models, Mapping) else models,
        heights=keys(heights) if isinstance(heights, Mapping) else heights,
    )


def _fitted(entry: CameraEntry, footage: Footage, rescale: bool) -> Camera:
    """Return a camera of the size of its footage.

    Raises:
        CalibrationError: the size is unknown.
        RecordingError: the calibration is for another size, and not to be scaled.
    """
    camera, size = entry.camera(footage.size), footage.size
    ratio = max(camera.width / size[0], size[0] / camera.width)
    is_multiple = (
        camera.size != size
        and ratio.is_integer()
        and ((camera.width * size[1] == camera.height * size[0]) and ratio > 1)
    )
    if is_multiple and rescale:
        return camera.scaled(size[0] / camera.width)
    sizes = f"camera '{entry.name}': the calibration is for {camera.width}x{camera.height} pixels, and the footage has"
    sizes += f" {size[0]}x{size[1]}"
    if is_multiple:
        raise RecordingError(
            f"{sizes}, a ratio of {ratio:g}, which is right only if the camera shows the same view at both sizes",
            Remedy("rescale"),
        )
    if camera.size != size and max(abs(camera.width - size[0]), abs(camera.height - size[1])) == 1:
        raise RecordingError(
            f"{sizes}: some programs write the index of the last pixel as size; correct 'size' in the calibration to "
            f"{size[0]}, {size[1]}, and leave all else as it is"
        )
    if camera.size == size[::-1] and entry.eccentricity(size) < entry.eccentricity(camera.size) / 2:
        raise RecordingError(
            f"{sizes}; its principal point shows that its size is height and width: exchange them in the calibration"
        )
    check_size(entry.name, footage.path, size, camera.size)
    return camera


def _clocks(request: NewSession, footage: Mapping[str, Footage], fps: float) -> tuple[ClockStarts | None, list[str]]:
    """Return the clocks by which frames are to be paired, if there are any, and sentences on them.

    Raises:
        RecordingError: the names of pictures do not show which are of one instant.
    """
    by_names = None if request.offsets else find_name_starts(footage)
    files = {name: f.path for name, f in footage.items()}
    declared = [f.fps for f in footage.values() if f.fps is not None]
    starts = find_clock_starts(files, fps, declared) if by_names is None else [by_names]
    clocks, notes = clock_notes(starts, {name: f.n_frames for name, f in footage.items()})
    if clocks is None:
        return None, notes
    if request.offsets:
        given = {name: request.offsets.get(name, 0.0) for name in footage}
        return None, disagreement("offsets given", given, clocks.source, clocks.starts)
    if by_names is None:
        notes += sound_disagreement(clocks, files, fps)
    return (clocks if clocks.is_needed else None), notes


def _left_out(sources: Sequence[CameraSource], n_frames: int) -> Iterator[str]:
    """Say which frames are left out because other cameras lack them."""
    for source in sources:
        if source.footage_frames is not None:
            rest = source.footage_frames - source.offset - n_frames
            yield f"camera '{source.camera.name}': frames that other cameras lack are left out at its end: {rest}"


def _source(request: NewSession, camera: Camera, footage: Footage, fps: float, n_frames: int) -> CameraSource:
    start = request.offsets.get(camera.name, 0)
    offset, side_name = whole_frames(start), request.side_names.get(camera.name, camera.name)
    source = CameraSource(
        camera,
        footage.path,
        find_background(request.background, side_name) if request.background is not None else None,
        find_masks(request.masks, side_name) if request.masks is not None else None,
        offset,
        None if footage.fps is None or same_rate(footage.fps, fps) else footage.fps,
        footage.n_frames if request.common_frames and footage.n_frames > n_frames + offset else None,
    )
    return source.starting_at(start)


def _make_people(
    names: Sequence[str], models: Mapping[str, str] | str, heights: Mapping[str, float] | float | None
) -> tuple[Person, ...]:
    if isinstance(models, Mapping):
        check_names(models, names, "person", "the body models")
    if isinstance(heights, Mapping):
        check_names(heights, names, "person", "the heights")
    people = []
    for i, name in enumerate(names):
        model = models.get(name, DEFAULT_MODEL) if isinstance(models, Mapping) else models
        height = heights.get(name) if isinstance(heights, Mapping) else heights
        sigma = None if height is None else STATED_HEIGHT_SIGMA
        body = replace(load_model(model, height), height_sigma=sigma)
        people.append(Person(name, body, PALETTE[i % len(PALETTE)]))
    return tuple(people)
