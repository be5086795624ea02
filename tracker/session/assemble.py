"""A new session from a calibration and loose footage: who belongs to whom, and whether they fit together."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from tracker.errors import RecordingError, SessionError
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import check_size, read_background, read_mask
from tracker.footage.video import IMAGE_SUFFIXES, Footage, open_footage
from tracker.formats.anipose import Units, read_calibration
from tracker.formats.model_toml import load_model
from tracker.geometry.cameras import Camera
from tracker.session.session import PALETTE, Person, Session, create_session

DEFAULT_MODEL = "gavrila34"

# Relative difference above which two frame rates are two: 29.97 and 30 differ by twice as much.
_RATE_TOLERANCE = 5e-4
_VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm")


def assemble(
    folder: str | Path,
    *,
    calibration: str | Path,
    videos: Sequence[str | Path] = (),
    camera_paths: Mapping[str, str | Path] | None = None,
    background: str | Path | None = None,
    masks: str | Path | None = None,
    offsets: Mapping[str, int] | None = None,
    people: Sequence[str] = ("person",),
    models: Mapping[str, str] | str = DEFAULT_MODEL,
    heights: Mapping[str, float] | float | None = None,
    fps: float | None = None,
    up: str = "z",
    units: Units = "m",
) -> Session:
    """Make a session folder of a calibration and footage; nothing is written unless all of it fits.

    Args:
        folder: where the session goes; must not exist, or be empty.
        calibration: TOML file in the anipose layout.
        videos: video files or image folders, each named after its camera.
        camera_paths: footage by camera name, whatever its own name; goes before `videos`.
        background: folder of CAM.png or CAM.mp4 of the empty scene.
        masks: folder of CAM/%06d.png.
        offsets: frames by which to shift a camera: frame k of the session is its frame k + offset.
        people: names of the people to track.
        models: body model (preset or .toml file) of all people, or by name; the rest have gavrila34.
        heights: body height of all people, or by name, metres; the rest have their model's own.
        fps: frame rate, 1/s; needed where all footage is folders of images.
        up: world axis that points up.
        units: unit of the calibration's translations.

    Raises:
        SessionError: a name that is not known, a camera without footage or footage without a camera.
        RecordingError: footage that is unreadable, or does not fit the calibration or the other cameras.
        CalibrationError: the calibration is malformed.
        ModelError: a body model is unknown or malformed.
    """
    cameras = read_calibration(calibration, units)
    offsets = offsets or {}
    _check_names(offsets, [c.name for c in cameras], "camera", "--offset")
    paths = _match(cameras, [Path(v) for v in videos], {n: Path(p) for n, p in (camera_paths or {}).items()})
    sources = tuple(
        CameraSource(
            c,
            paths[c.name],
            _find_background(Path(background), c) if background is not None else None,
            _find_masks(Path(masks), c) if masks is not None else None,
            offsets.get(c.name, 0),
        )
        for c in cameras
    )
    footage = {c.name: open_footage(paths[c.name], c.name) for c in cameras}
    try:
        for c in cameras:
            check_size(c.name, footage[c.name].path, footage[c.name].size, c.size)
        common_fps = _common_rate(footage, fps)
        n_frames = _common_length(footage, offsets)
    finally:
        for f in footage.values():
            f.close()
    for source in sources:
        _check_side_files(source)
    return create_session(
        folder,
        cameras=sources,
        people=_make_people(people, models, heights),
        fps=common_fps,
        n_frames=n_frames,
        up=up,
    )


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
    """Read the background and the first mask, so that a misfit shows now and not in the midst of tracking."""
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
