"""Find files of a session that have moved, and give them their new place; annotations stay as they are."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, takewhile
from pathlib import Path
from typing import NamedTuple

from tracker.errors import RecordingError, Remedy, SessionError, TrackerError
from tracker.files import entries_below
from tracker.footage.camera_source import CameraSource, MissingFile, PathKind, missing_files
from tracker.footage.frame_rates import same_rate
from tracker.footage.recording import check_size, read_background
from tracker.footage.video import open_footage
from tracker.session.footage_files import check_side_files, find_background, find_masks
from tracker.session.matching import check_names, find_entry
from tracker.session.session import Session, save_camera_files
from tracker.validation import nfc_name


class Relinked(NamedTuple):
    """A file or folder with its new place."""

    camera: str
    kind: PathKind
    old: Path | None
    """None for masks of a camera that used none."""
    new: Path


@dataclass(frozen=True)
class Places:
    """Present paths of the files of a session."""

    search: Sequence[Path] = ()
    """Folders in which missing files are searched by name, with all folders inside."""
    camera_paths: Mapping[str, Path] = field(default_factory=dict)
    """Footage by camera name, under any file name."""
    background: Path | None = None
    """Folder of CAM.png or CAM.mp4 of the empty scene."""
    masks: Path | None = None
    """Folder of CAM/%06d.png; where no camera has masks, those get them that have a folder in it."""


def require_files(session: Session) -> None:
    """Check that all footage, backgrounds and masks are there.

    Raises:
        SessionError: some are not; the message says how to give them their new place.
    """
    if missing := missing_files(session.cameras):
        first = missing[0]
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise SessionError(
            f"camera '{first.camera}': {first.kind} {first.path}{more} not found",
            Remedy("relink", session=session.folder),
        )


def relink(session: Session, places: Places) -> tuple[Session, tuple[Relinked, ...]]:
    """Give files of a session their new place in session.toml. Nothing is written unless all that is found fits.

    Files that are searched and not found stay missing (`missing_files` of the result).

    Returns:
        The session with the new places, and what has changed.

    Raises:
        SessionError: an unknown camera, a folder that is not there, or a name that is found in several places.
        RecordingError: a file is unreadable, or not the footage that the session was made of.
    """
    check_names(places.camera_paths, [c.camera.name for c in session.cameras], "camera", "the footage by camera")
    given = _given(session, places)
    asked = {(f.camera, f.kind) for f in given}
    missing = [m for m in missing_files(session.cameras) if (m.camera, m.kind) not in asked]
    if places.search:
        named = _files_named({m.path.name for m in missing}, places.search)
        for lost in missing:
            new = _choose(
                lost, named.get(nfc_name(lost.path.name), []), partial(_check, session, lost.camera, lost.kind)
            )
            if new is not None:
                given.append(Relinked(lost.camera, lost.kind, lost.path, new))
    _check_once(given)
    if not given:
        return session, ()
    changes: dict[str, dict[str, Path]] = {}
    for f in given:
        changes.setdefault(f.camera, {})[f.kind] = f.new
    cameras = tuple(replace(c, **changes.get(c.camera.name, {})) for c in session.cameras)  # pyrefly: ignore[bad-argument-type]
    return save_camera_files(session, cameras), tuple(given)


def leave_masks(session: Session) -> Session:
    """Let no camera use masks, so that its background counts again. The files of the masks stay.

    Raises:
        SessionError: session.toml cannot be written.
    """
    return save_camera_files(session, [replace(c, masks=None) for c in session.cameras])


def _masked(session: Session, folder: Path) -> list[str]:
    """Return the cameras whose masks a folder must have: those with masks, else those with a folder in it."""
    names = [c.camera.name for c in session.cameras]
    with_masks = [c.camera.name for c in session.cameras if c.masks is not None]
    return with_masks or [n for n in names if find_entry(folder, n).is_dir()] or names


def _given(session: Session, places: Places) -> list[Relinked]:
    """Check the places that a user has given."""
    if places.background is not None and all(c.background is None for c in session.cameras):
        raise SessionError(
            f"no camera of {session.folder} has a background to relink", Remedy("relink_nothing", kind="background")
        )
    masked = _masked(session, places.masks) if places.masks is not None else ()
    by_name = {nfc_name(name): path for name, path in places.camera_paths.items()}
    missing = []
    for source in session.cameras:
        name = source.camera.name
        given: dict[PathKind, Path] = {}
        if (own := by_name.get(nfc_name(name))) is not None:
            given["footage"] = own
        if places.background is not None and source.background is not None:
            given["background"] = find_background(places.background, name)
        if places.masks is not None and name in masked:
            given["masks"] = find_masks(places.masks, name)
        for kind, path in given.items():
            path = Path(os.path.abspath(path))
            _check(session, name, kind, path)
            missing.append(Relinked(name, kind, getattr(source, kind), path))
    return missing


def _files_named(names: Iterable[str], folders: Sequence[Path]) -> dict[str, list[Path]]:
    """Find all files and folders with the given names below some folders, by the form in which names are compared."""
    wanted, found = {nfc_name(name) for name in names}, dict[str, list[Path]]()
    for folder in folders:
        if not folder.is_dir():
            raise SessionError(f"expected a folder to search, found {folder}, which is none", Remedy("relink_search"))
        if not wanted:
            continue
        root = Path(os.path.abspath(folder))
        everything = (Path(e.path) for e in entries_below(root, SessionError, passes_unreadable=True))
        for path in chain([root], everything):
            key = nfc_name(path.name)
            if key in wanted and path not in found.setdefault(key, []):
                found[key].append(path)
    return found


def _choose(lost: MissingFile, candidates: Sequence[Path], check: Callable[[Path], None]) -> Path | None:
    """Choose the candidate that fits and whose path ends most like the old one; None without candidates."""
    fitting, refused = [], list[TrackerError]()
    for path in candidates:
        try:
            check(path)
            fitting.append(path)
        except TrackerError as error:
            refused.append(error)
    if candidates and not fitting:
        raise refused[0]
    if not fitting:
        return None
    alike = [_common_tail(lost.path, path) for path in fitting]
    best = [path for path, n in zip(fitting, alike, strict=True) if n == max(alike)]
    if len(best) > 1:
        raise SessionError(
            f"camera '{lost.camera}': the {lost.kind} may be {best[0]} or {best[1]}",
            Remedy("relink_which_footage", camera=lost.camera)
            if lost.kind == "footage"
            else Remedy("relink_which_side_files", kind=lost.kind),
        )
    return best[0]


def _common_tail(a: Path, b: Path) -> int:
    """Return how many names two paths share at their ends."""
    pairs = zip(reversed(a.parts), reversed(b.parts), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _check(session: Session, camera: str, kind: PathKind, path: Path) -> None:
    """Check that a file can take the place of one of the session.

    Raises:
        RecordingError: it cannot be read, or has another size, number of frames or frame rate.
    """
    source = next(c for c in session.cameras if c.camera.name == camera)
    if kind == "background":
        read_background(replace(source, background=path))
    elif kind == "masks":
        check_side_files(replace(source, background=None, masks=path))
    else:
        _check_footage(session, source, path)


def _check_footage(session: Session, source: CameraSource, path: Path) -> None:
    name, offsets = source.camera.name, [c.offset for c in session.cameras]
    # Videos of one length lose frames at the end by the offsets of the others.
    lengths = {session.n_frames + source.offset, session.n_frames + max(offsets)}
    if source.footage_frames is not None:
        lengths = {source.footage_frames}
    expected_fps = session.fps if source.declared_fps is None else source.declared_fps
    with closing(open_footage(path, name)) as footage:
        check_size(name, path, footage.size, source.camera.size)
        if footage.n_frames not in lengths:
            raise _other(name, path, " or ".join(map(str, sorted(lengths))) + " frames", str(footage.n_frames))
        if footage.fps is not None and not same_rate(footage.fps, expected_fps):
            raise _other(name, path, f"{expected_fps:g} frames per second", f"{footage.fps:g}")


def _other(camera: str, path: Path, expected: str, found: str) -> RecordingError:
    return RecordingError(
        f"camera '{camera}': expected {expected} as in the session, found {found} in {path}; "
        "it is other footage: give the one that the session was made of"
    )


def _check_once(found: Sequence[Relinked]) -> None:
    """Check that no two cameras share a file."""
    path, count = Counter(f.new for f in found).most_common(1)[0] if found else (Path(), 0)
    if count > 1:
        cameras = " and ".join(f"'{f.camera}'" for f in found if f.new == path)
        raise SessionError(f"cameras {cameras} would share {path}", Remedy("relink_each"))
