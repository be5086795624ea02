"""Make a session from a calibration and loose footage: match them, and check that they fit together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tracker.errors import RecordingError, SessionError
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import IMAGE_SUFFIXES
from tracker.footage.recording import check_size, read_background, read_mask
from tracker.footage.video import Footage, open_footage
from tracker.formats.anipose import Units, read_calibration
from tracker.formats.model_toml import load_model
from tracker.geometry.cameras import Camera
from tracker.session.session import PALETTE, Person, Session, create_session
from tracker.validation import FrameRate, check

DEFAULT_MODEL = "gavrila34"

_RATE_TOLERANCE = 5e-4
"""Relative difference above which two frame rates differ; 29.97 and 30 differ by twice as much."""
_VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm")


@dataclass(frozen=True)
class NewSession:
    """A request for a new session."""

    folder: Path
    """Where the session goes; must not exist, or be empty."""
    calibration: Path
    """TOML file in the anipose layout."""
    videos: Sequence[Path] = ()
    """Video files or image folders, each named after its camera."""
    camera_paths: Mapping[str, Path] = field(default_factory=dict)
    """Footage by camera name, under any file name; goes before `videos`."""
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
    """Frame rate, 1/s; needed if all footage is folders of images."""
    up: str = "z"
    """World axis that points up."""
    units: Units = "m"
    """Unit of the calibration's translations."""


def assemble(request: NewSession) -> Session:
    """Make a session folder of a calibration and footage. Nothing is written unless all of it fits.

    Raises:
        SessionError: an unknown name, a camera without footage or footage without a camera.
        RecordingError: footage that is unreadable, or does not fit the calibration or the other cameras.
        CalibrationError: the calibration is malformed.
        ModelError: a body model is unknown or malformed.
    """
    cameras = read_calibration(request.calibration, request.units)
    _check_names(request.offsets, [c.name for c in cameras], "camera", "--offset")
    paths = _match(cameras, request.videos, request.camera_paths)
    sources = tuple(
        CameraSource(
            c,
            paths[c.name],
            _find_background(request.background, c) if request.background is not None else None,
            _find_masks(request.masks, c) if request.masks is not None else None,
            request.offsets.get(c.name, 0),
        )
        for c in cameras
    )
    footage = {c.name: open_footage(paths[c.name], c.name) for c in cameras}
    try:
        for c in cameras:
            check_size(c.name, footage[c.name].path, footage[c.name].size, c.size)
        fps = _common_rate(footage, request.fps)
        n_frames = _common_length(footage, request.offsets)
    finally:
        for f in footage.values():
            f.close()
    for source in sources:
        _check_side_files(source)
    people = _make_people(request.people, request.models, request.heights)
    return create_session(request.folder, cameras=sources, people=people, fps=fps, n_frames=n_frames, up=request.up)


def _match(cameras: Sequence[Camera], videos: Sequence[Path], camera_paths: Mapping[str, Path]) -> dict[str, Path]:
    """Find the footage of each camera: by the option, else by the name of the file or folder."""
    names = [c.name for c in cameras]
    _check_names(camera_paths, names, "camera", "--camera")
    paths = dict(camera_paths)
    for video in videos:
        name = video.name if video.is_dir() else video.stem
        if name in camera_paths or video in camera_paths.values():
            continue
        if name not in names:
            raise SessionError(
                f"video {video} belongs to no calibrated camera: expected one named {', '.join(names)}; "
                f"rename it, leave it out or say --camera NAME={video}"
            )
        if name in paths:
            raise SessionError(f"camera '{name}' has two videos, {paths[name]} and {video}; leave one out")
        paths[name] = video
    missing = [n for n in names if n not in paths]
    if missing:
        raise SessionError(
            f"no video for camera {', '.join(missing)}; give a file named {missing[0]}.mp4, "
            f"say --camera {missing[0]}=PATH, or remove the camera from the calibration"
        )
    return paths


def _common_rate(footage: Mapping[str, Footage], fps: float | None) -> float:
    rates = {name: f.fps for name, f in footage.items() if f.fps is not None}
    for name, f in footage.items():
        if not f.has_constant_rate:
            raise RecordingError(
                f"camera '{name}': {f.path} has a variable frame rate, expected a constant one; "
                "convert it to a constant rate with frames at the times of the other cameras"
            )
    wanted = fps if fps is not None else next(iter(rates.values()), None)
    if wanted is None:
        raise RecordingError("folders of images do not say their frame rate; say --fps RATE")
    check(wanted, FrameRate, "--fps" if fps is not None else "footage", RecordingError)
    if any(abs(rate / wanted - 1) > _RATE_TOLERANCE for rate in rates.values()):
        found = ", ".join(f"'{name}' {rate:.6g}" for name, rate in rates.items())
        asked = "one frame rate for all cameras" if fps is None else f"{fps:.6g} frames per second"
        raise RecordingError(f"expected {asked}, found {found}; convert the videos to the same rate")
    return wanted


def _common_length(footage: Mapping[str, Footage], offsets: Mapping[str, int]) -> int:
    """Number of frames that all cameras have; lengths may differ by the offsets alone."""
    rest = {name: f.n_frames - offsets.get(name, 0) for name, f in footage.items()}
    if len({f.n_frames for f in footage.values()}) > 1 and len(set(rest.values())) > 1:
        found = ", ".join(f"'{name}' {f.n_frames}" for name, f in footage.items())
        raise RecordingError(
            f"expected videos of the same number of frames, found {found}; "
            "cut them to the same start and end, or say --offset CAM=N for a camera that began N frames earlier"
        )
    return min(rest.values())


def _find_background(folder: Path, camera: Camera) -> Path:
    for suffix in (*IMAGE_SUFFIXES, *_VIDEO_SUFFIXES):
        path = folder / f"{camera.name}{suffix}"
        if path.is_file():
            return path
    raise RecordingError(
        f"camera '{camera.name}': no background in {folder}: expected {camera.name}.png or {camera.name}.mp4; "
        "add it or leave out --background"
    )


def _find_masks(folder: Path, camera: Camera) -> Path:
    path = folder / camera.name
    if not any(path.glob("[0-9]" * 6 + ".png")):
        raise RecordingError(
            f"camera '{camera.name}': no masks in {path}: expected files named 000000.png and so on by video frame; "
            "add them or leave out --masks"
        )
    return path


def _check_side_files(source: CameraSource) -> None:
    """Read the background and the first mask, so that a misfit shows before tracking starts."""
    read_background(source)
    if source.masks is not None:
        first = min(source.masks.glob("[0-9]" * 6 + ".png"))
        read_mask(source, int(first.stem) - source.offset)


def _make_people(
    names: Sequence[str], models: Mapping[str, str] | str, heights: Mapping[str, float] | float | None
) -> tuple[Person, ...]:
    if isinstance(models, Mapping):
        _check_names(models, names, "person", "--model")
    if isinstance(heights, Mapping):
        _check_names(heights, names, "person", "--height")
    people = []
    for i, name in enumerate(names):
        model = models.get(name, DEFAULT_MODEL) if isinstance(models, Mapping) else models
        height = heights.get(name) if isinstance(heights, Mapping) else heights
        people.append(Person(name, load_model(model, height), PALETTE[i % len(PALETTE)]))
    return tuple(people)


def _check_names(given: Iterable[str], known: Sequence[str], what: str, option: str) -> None:
    unknown = [n for n in given if n not in known]
    if unknown:
        raise SessionError(f"{option} names an unknown {what} '{unknown[0]}'; expected one of {', '.join(known)}")
