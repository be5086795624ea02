"""Sessions: calibrated cameras with their footage and people with their body models, in one folder.

    my_session/
      session.toml         version, name, fps, n_frames, up, floor, per camera its footage, the people
      calibration.toml     anipose / Pose2Sim layout, metres
      models/NAME.toml     a person's body model
      annotations.sqlite   poses (see `tracker.session.store.annotation_store`)
      identity.txt         identity that copies of the folder share

Footage may lie anywhere. Paths in session.toml are relative to the session folder for files in it or beside it, so
that both can be moved together, and absolute otherwise.
"""

import re
import secrets
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tracker.body.model import BodyModel
from tracker.errors import SessionError
from tracker.files import check_regular, read_regular, refuse_links, write_text_atomic
from tracker.footage.camera_source import CameraSource, Clock, LostFrames
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.formats.file_names import file_stems
from tracker.formats.model_toml import format_model, load_model
from tracker.geometry.ground_plane import GroundPlane
from tracker.session.folder import SESSION_FILE, appearing, require_free, session_folder, tidy_path
from tracker.session.session_file import FloorRow, SessionFile, checked, needed_version, read_session_file
from tracker.validation import quoted

CALIBRATION_FILE = "calibration.toml"
ANNOTATIONS_FILE = "annotations.sqlite"
IDENTITY_FILE = "identity.txt"
PALETTE = ("#53a504", "#d062f2", "#f5b8c2", "#60c0d8", "#96f19e", "#abb179", "#8793a7", "#a78c85")
"""Colours of the people of a new session, distinct from one another with every kind of colour vision."""


@dataclass(frozen=True, eq=False)
class Person:
    """A person to be tracked."""

    name: str
    model: BodyModel
    color: str
    """Colour in which the person is drawn, `#rrggbb`."""


@dataclass(frozen=True, eq=False)
class Session:
    """A recording, its cameras and its people."""

    folder: Path
    """The session's folder; absolute."""
    name: str
    """Title for display."""
    fps: float
    """Rate at which all cameras filmed, 1/s; what a video declares may differ (`CameraSource.declared_fps`)."""
    n_frames: int
    """Number of frames that all cameras have."""
    cameras: tuple[CameraSource, ...]
    people: tuple[Person, ...]
    up: str = "z"
    """World axis that points up: x, y or z, with a minus sign for an axis that points down."""
    floor: GroundPlane | None = None
    """The floor set by a person; None for the plane through the world's origin across `up`."""
    uid: str = ""
    """Identity from its making on, 32 hexadecimal digits, which all copies share; empty for older sessions."""

    @property
    def camera_names(self) -> tuple[str, ...]:
        """Names of the cameras, in order."""
        return tuple(c.camera.name for c in self.cameras)

    @property
    def has_outlines(self) -> bool:
        """Whether some camera has a background or masks; else only motion separates people from the scene."""
        return any(c.background or c.masks for c in self.cameras)

    @property
    def annotations_path(self) -> Path:
        """Path of the database of the session's poses."""
        return self.folder / ANNOTATIONS_FILE


def create_session(
    folder: str | Path,
    *,
    cameras: Sequence[CameraSource],
    people: Sequence[Person],
    fps: float,
    n_frames: int | None = None,
    name: str | None = None,
    up: str = "z",
) -> Session:
    """Write a new session folder; it appears complete or not at all.

    Args:
        folder: path of the session; must not exist, or be empty.
        cameras: at least one.
        people: at least one.
        fps: frame rate of all cameras, 1/s.
        n_frames: number of frames; by default as many as all cameras have.
        name: title; by default the folder's name.
        up: world axis that points up.

    Raises:
        SessionError: the folder is in use or cannot be written, or a name or axis is not allowed.
        RecordingError: footage is missing or unreadable (only if `n_frames` is left out).
    """
    folder = tidy_path(Path(folder))
    require_free(folder)
    sources = tuple(_absolute(c) for c in cameras)
    if n_frames is None:
        from tracker.footage.video import open_footage  # imported lazily: PyAV takes 0.1 s to load

        n_frames = min((open_footage(c.footage, c.camera.name).n_frames - c.offset for c in sources), default=0)
    title, uid = name or folder.name, secrets.token_hex(16)
    session = Session(folder, title, float(fps), n_frames, sources, tuple(people), up, uid=uid)
    check_content(session)
    with appearing(folder) as temporary:
        _write(session, temporary)
    return session


def save_session(session: Session) -> None:
    """Write a session's files into its folder, which is created if missing; session.toml comes last.

    Raises:
        SessionError: a name or axis is not allowed, or the folder cannot be written.
    """
    check_content(session)
    with _writing(f"the session {session.folder}", "choose a folder you may write to"):
        session.folder.mkdir(parents=True, exist_ok=True)
        _write(replace(session, cameras=tuple(_absolute(c) for c in session.cameras)), session.folder)


def load_session(folder: str | Path) -> Session:
    """Read a session folder. Footage is not opened; `Recording` does that.

    Raises:
        SessionError: there is no session, or it is newer than this program or malformed.
        CalibrationError: the calibration is missing or malformed.
        ModelError: a body model is missing or malformed.
    """
    folder = session_folder(folder)
    row = read_session_file(folder / SESSION_FILE)
    return Session(
        folder,
        row.name,
        row.fps,
        row.n_frames,
        _load_cameras(row, folder),
        tuple(Person(p.name, load_model(_resolve(p.model, folder)), p.color) for p in row.people),
        row.up,
        _load_floor(row.floor),
        _read_uid(folder / IDENTITY_FILE),
    )


def _load_cameras(row: SessionFile, folder: Path) -> tuple[CameraSource, ...]:
    """Join the calibration and the footage of each camera, in the order of session.toml."""
    calibrated = {c.name: c for c in read_calibration(_resolve(row.calibration, folder))}
    odd = calibrated.keys() ^ {c.name for c in row.cameras}
    if odd:
        raise SessionError(
            f"session {folder / SESSION_FILE}: expected each calibrated camera once under [[cameras]], "
            f"but see: {', '.join(sorted(odd))}"
        )
    return tuple(
        CameraSource(
            calibrated[c.name],
            _resolve(c.footage, folder),
            _resolve(c.background, folder) if c.background is not None else None,
            _resolve(c.masks, folder) if c.masks is not None else None,
            c.offset,
            c.declared_fps,
            c.footage_frames,
            Clock(round(c.time_offset_s * row.fps, 9), c.time_rate, tuple(LostFrames(*lost) for lost in c.lost_frames)),
        )
        for c in row.cameras
    )


def save_camera_files(session: Session, cameras: Sequence[CameraSource]) -> Session:
    """Replace the places of footage, backgrounds and masks in a session's session.toml.

    Args:
        session: as it was loaded.
        cameras: the same cameras with other paths.

    Returns:
        The session with those cameras.

    Raises:
        SessionError: a path is not allowed, or the folder cannot be written.
    """
    changed = replace(session, cameras=tuple(_absolute(c) for c in cameras))
    _save_session_file(changed)
    return changed


def save_floor(session: Session, up: str, floor: GroundPlane | None) -> Session:
    """Replace the floor in a session's session.toml.

    Args:
        session: as it was loaded.
        up: world axis that points up, or is nearest to it.
        floor: None for the plane through the world's origin.

    Returns:
        The session with that floor.

    Raises:
        SessionError: the folder cannot be written.
    """
    changed = replace(session, up=up, floor=floor)
    _save_session_file(changed)
    return changed


def _save_session_file(session: Session) -> None:
    check_content(session)
    with _writing(session.folder / SESSION_FILE):
        _write_session(session, session.folder)


@contextmanager
def _writing(what: str | Path, advice: str = "see that you may write to the folder") -> Generator[None, None, None]:
    """Name what could not be written in the `with` block.

    Raises:
        SessionError: it could not.
    """
    try:
        yield
    except OSError as error:
        raise SessionError(f"cannot write {what}: {error}; {advice}") from error


def save_model(session: Session, person: int, model: BodyModel) -> Session:
    """Replace the body model of a person in a session's folder.

    Returns:
        The session with that model.

    Raises:
        SessionError: the folder cannot be written.
    """
    people = [replace(p, model=model) if i == person else p for i, p in enumerate(session.people)]
    changed = replace(session, people=tuple(people))
    path = session.folder / _model_files(people)[person]
    refuse_links(session.folder, SESSION_FILE, f"models/{path.name}")
    with _writing(path):
        path.parent.mkdir(exist_ok=True)
        write_text_atomic(path, format_model(model))
        _write_session(changed, session.folder)
    return changed


def _load_floor(row: FloorRow | None) -> GroundPlane | None:
    if row is None:
        return None
    normal = np.array(row.normal)
    return GroundPlane(normal / np.linalg.norm(normal), row.offset_m)


def _write(session: Session, into: Path) -> None:
    """Write the files of a session into a folder that is, or will become, `session.folder`."""
    refuse_links(into, CALIBRATION_FILE)
    write_calibration(into / CALIBRATION_FILE, [c.camera for c in session.cameras])
    _write_models(session, into)
    if session.uid:
        refuse_links(into, IDENTITY_FILE)
        write_text_atomic(into / IDENTITY_FILE, f"{session.uid}\n")
    _write_session(session, into)


def _read_uid(path: Path) -> str:
    """Return the identity of a session; empty where the file is missing, as in sessions of older programs.

    Raises:
        SessionError: the file holds something else, or cannot be read.
    """
    try:
        uid = read_regular(path, 100).decode("ascii", "replace").strip()
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise SessionError(f"{path} cannot be read: {error}; see that you may read it") from error
    if not re.fullmatch("[0-9a-f]{32}", uid):
        raise SessionError(f"{path}: expected 32 hexadecimal digits, found {quoted(uid)}; copy it again or remove it")
    return uid


def _write_session(session: Session, into: Path) -> None:
    """Write session.toml, and bodies of people whose file it did not name so far."""
    refuse_links(into, SESSION_FILE)
    _write_models(session, into, are_missing=True)
    write_text_atomic(into / SESSION_FILE, tomli_w.dumps(check_content(session)))


def _write_models(session: Session, into: Path, are_missing: bool = False) -> None:
    """Write the bodies of all people, or those whose file is missing."""
    models = dict(zip(_model_files(session.people), session.people, strict=True))
    wanted = [file for file in models if not (are_missing and (into / file).exists())]
    refuse_links(into, *wanted)
    for file in wanted:
        (into / file).parent.mkdir(exist_ok=True)
        write_text_atomic(into / file, format_model(models[file].model))


def _model_files(people: Sequence[Person]) -> list[str]:
    """Return the file of each person's body within the session."""
    return [f"models/{stem}.toml" for stem in file_stems([p.name for p in people])]


def check_content(session: Session) -> dict[str, Any]:
    """Check the content of a session.toml as if it were read, and return it.

    Raises:
        SessionError: a name, axis, rate, number or path is not allowed.
    """
    cameras = []
    for c in session.cameras:
        optional = {
            "declared_fps": c.declared_fps,
            "footage_frames": c.footage_frames,
            "time_offset_s": round(c.clock.ahead_frames / session.fps, 12) if c.clock.ahead_frames else None,
            "time_rate": float(c.clock.rate) or None,
            "lost_frames": [list(lost) for lost in c.clock.lost] or None,
        }
        paths = {kind: _relative(path, session.folder) for kind, path in c.paths.items()}
        row = {"name": c.camera.name, **paths, "offset": c.offset, **optional}
        cameras.append({key: value for key, value in row.items() if value is not None})
    data: dict[str, Any] = {
        "name": session.name,
        "fps": session.fps,
        "n_frames": session.n_frames,
        "up": session.up,
        "calibration": CALIBRATION_FILE,
        "cameras": cameras,
        "people": [
            {"name": p.name, "model": file, "color": p.color}
            for p, file in zip(session.people, _model_files(session.people), strict=True)
        ],
    }
    if session.floor is not None:
        data["floor"] = {"normal": session.floor.normal.tolist(), "offset_m": float(session.floor.offset_m)}
    data = {"version": needed_version(data)} | data
    checked(data, f"session {session.folder}")
    return data


def _absolute(source: CameraSource) -> CameraSource:
    """Make relative paths absolute by the current working folder, which the session outlives."""
    return replace(
        source,
        footage=tidy_path(source.footage),
        background=tidy_path(source.background) if source.background is not None else None,
        masks=tidy_path(source.masks) if source.masks is not None else None,
    )


def _relative(path: Path, folder: Path) -> str:
    """Return a path relative to the session folder if it lies in it or in its parent, else absolute."""
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    # Every path lies in the root of the file system: paths that share only the root do not move with the session.
    if folder.parent != Path(folder.anchor) and path.is_relative_to(folder.parent):
        return (Path("..") / path.relative_to(folder.parent)).as_posix()
    return path.as_posix()


def _resolve(text: str, folder: Path) -> Path:
    path = tidy_path(folder / text)
    try:
        check_regular(path)
    except OSError as error:
        raise SessionError(
            f"session {folder}: expected the path of a file or folder, found {quoted(text)}, where the system says: "
            f"{error.strerror}; correct it"
        ) from error
    return path
