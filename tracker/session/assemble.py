"""Make a session from a calibration and loose footage: match them, and check that they fit together."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from tracker.errors import RecordingError, SessionError
from tracker.footage.camera_source import CameraSource
from tracker.footage.frame_rates import same_rate
from tracker.footage.image_file import IMAGE_SUFFIXES
from tracker.footage.recording import check_size, read_background, read_mask
from tracker.footage.video import Footage, open_footage
from tracker.formats.calibration import read_cameras
from tracker.formats.camera_section import Units
from tracker.formats.model_toml import load_model
from tracker.geometry.cameras import Camera
from tracker.session.matching import (
    camera_name,
    check_image_numbers,
    check_names,
    common_length,
    common_offsets,
    common_rate,
    footage_notes,
    match_footage,
)
from tracker.session.session import PALETTE, Person, Session, create_session

DEFAULT_MODEL = "gavrila34"
_VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm")


@dataclass(frozen=True)
class NewSession:
    """A request for a new session."""

    folder: Path
    """Where the session goes; must not exist, or be empty."""
    calibration: Path
    """TOML, JSON, YAML or XML file (`tracker.formats.calibration`)."""
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
    offsets: Mapping[str, int] = field(default_factory=dict)
    """Shift by camera name: frame k of the session is frame k + offset of the camera."""
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


def assemble(
    request: NewSession, report: Callable[[str], None] = lambda _: None, note: Callable[[str], None] = lambda _: None
) -> Session:
    """Make a session folder of a calibration and footage. Nothing is written unless all of it fits.

    Args:
        request: what to make it of.
        report: called with a sentence after each check that has passed.
        note: called with each sentence on something that a person should look at.

    Raises:
        SessionError: an unknown name, a camera without footage or footage without a camera.
        RecordingError: footage that is unreadable, or does not fit the calibration or the other cameras.
        CalibrationError: the calibration is malformed.
        ModelError: a body model is unknown or malformed.
    """
    request = replace(request, videos=tuple(request.videos))
    calibrated = {c.name: c for c in read_cameras(request.calibration, request.units)}
    check_names(request.cameras, list(calibrated), "camera", "--cameras")
    if twice := [n for n in request.cameras if request.cameras.count(n) > 1]:
        raise SessionError(f"expected each camera once as --cameras, found '{twice[0]}' twice; leave one out")
    without = [] if request.cameras else unfilmed_cameras(request, list(calibrated))
    names = list(request.cameras) or [n for n in calibrated if n not in without]
    report(f"The calibration has {len(calibrated)} cameras: {', '.join(calibrated)}.")
    if without:
        report(f"Cameras without footage are left out: {', '.join(without)}.")
    unused = calibrated.keys() - set(names)
    check_names(request.offsets, names, "camera", "--offset")
    paths = match_footage(names, request.videos, request.camera_paths, unused)
    report("Each camera has footage: " + ", ".join(f"{name} ({paths[name].name})" for name in names) + ".")
    footage = {name: open_footage(paths[name], name) for name in names}
    try:
        cameras = {name: calibrated[name].camera(footage[name].size) for name in names}
        for name in names:
            check_size(name, footage[name].path, footage[name].size, cameras[name].size)
        report("All footage can be read and has the calibrated shape.")
        fps = common_rate(footage, request.fps)
        check_image_numbers(footage, request.offsets, request.common_frames)
        if request.common_frames:
            request = replace(request, offsets=common_offsets(footage, request.offsets))
        n_frames = common_length(footage, request.offsets, request.common_frames)
        report(f"All cameras have {n_frames} frames at {fps:g} per second.")
        sources = tuple(_source(request, cameras[name], footage[name], fps, n_frames) for name in names)
        for sentence in (*_left_out(sources, n_frames), *footage_notes(footage, fps, request.offsets)):
            note(sentence)
    finally:
        for f in footage.values():
            f.close()
    for source in sources:
        check_side_files(source)
    people = _make_people(request.people, request.models, request.heights)
    report("The body models fit: " + ", ".join(f"{p.name} {p.model.height_m:.2f} m" for p in people) + ".")
    return create_session(request.folder, cameras=sources, people=people, fps=fps, n_frames=n_frames, up=request.up)


def unfilmed_cameras(request: NewSession, calibrated: Sequence[str] | None = None) -> list[str]:
    """Return the calibrated cameras that a request gives no footage; none if it gives no calibrated camera any.

    Args:
        request: of a new session.
        calibrated: names of the calibrated cameras; read from the request's calibration by default.

    Raises:
        CalibrationError: the calibration is malformed.
    """
    if calibrated is None:
        calibrated = [c.name for c in read_cameras(request.calibration, request.units)]
    filmed = {*request.camera_paths, *map(camera_name, request.videos)}
    missing = [n for n in calibrated if n not in filmed]
    return missing if len(missing) < len(calibrated) else []


def _left_out(sources: Sequence[CameraSource], n_frames: int) -> Iterator[str]:
    """Say which frames are left out because other cameras lack them."""
    for source in sources:
        if source.footage_frames is not None:
            rest = source.footage_frames - source.offset - n_frames
            yield f"camera '{source.camera.name}': frames that other cameras lack are left out at its end: {rest}"


def _source(request: NewSession, camera: Camera, footage: Footage, fps: float, n_frames: int) -> CameraSource:
    offset = request.offsets.get(camera.name, 0)
    return CameraSource(
        camera,
        footage.path,
        find_background(request.background, camera.name) if request.background is not None else None,
        find_masks(request.masks, camera.name) if request.masks is not None else None,
        offset,
        None if footage.fps is None or same_rate(footage.fps, fps) else footage.fps,
        footage.n_frames if request.common_frames and footage.n_frames > n_frames + offset else None,
    )


def footage_in(folder: Path) -> list[Path]:
    """Return the videos of a folder, or its folders of images if it has no video.

    Raises:
        SessionError: there is neither.
    """
    try:
        entries = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise SessionError(f"expected a folder of videos, found that {folder} cannot be read ({error})") from error
    videos = [path for path in entries if path.suffix.lower() in _VIDEO_SUFFIXES and path.is_file()]
    found = videos or [path for path in entries if path.is_dir() and _has_image(path)]
    if not found:
        raise SessionError(
            f"expected videos ({', '.join(_VIDEO_SUFFIXES)}) or folders of images in {folder}, found none; "
            "choose the folder that holds the footage of all cameras"
        )
    return found


def _has_image(folder: Path) -> bool:
    return any(path.suffix.lower() in IMAGE_SUFFIXES for path in folder.iterdir())


def find_background(folder: Path, camera: str) -> Path:
    """Find the background of a camera by its name, an image or a video.

    Raises:
        RecordingError: there is none.
    """
    for suffix in (*IMAGE_SUFFIXES, *_VIDEO_SUFFIXES):
        path = folder / f"{camera}{suffix}"
        if path.is_file():
            return path
    raise RecordingError(
        f"camera '{camera}': no background in {folder}: expected {camera}.png or {camera}.mp4; "
        "add it or leave out --background"
    )


def find_masks(folder: Path, camera: str) -> Path:
    """Find the folder of masks of a camera by its name.

    Raises:
        RecordingError: there is none, or it has no masks.
    """
    path = folder / camera
    if not any(path.glob("[0-9]" * 6 + ".png")):
        raise RecordingError(
            f"camera '{camera}': no masks in {path}: expected files named 000000.png and so on by video frame; "
            "add them or leave out --masks"
        )
    return path


def check_side_files(source: CameraSource) -> None:
    """Read the background and the first mask, so that a misfit shows before tracking starts.

    Raises:
        RecordingError: one is missing, unreadable or of another size than the camera.
    """
    read_background(source)
    if source.masks is not None:
        first = min(find_masks(source.masks.parent, source.masks.name).glob("[0-9]" * 6 + ".png"))
        read_mask(source, int(first.stem) - source.offset)


def _make_people(
    names: Sequence[str], models: Mapping[str, str] | str, heights: Mapping[str, float] | float | None
) -> tuple[Person, ...]:
    if isinstance(models, Mapping):
        check_names(models, names, "person", "--model")
    if isinstance(heights, Mapping):
        check_names(heights, names, "person", "--height")
    people = []
    for i, name in enumerate(names):
        model = models.get(name, DEFAULT_MODEL) if isinstance(models, Mapping) else models
        height = heights.get(name) if isinstance(heights, Mapping) else heights
        people.append(Person(name, load_model(model, height), PALETTE[i % len(PALETTE)]))
    return tuple(people)
