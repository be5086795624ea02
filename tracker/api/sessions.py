"""Open and make sessions, and find people by their names."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

from tracker.errors import SessionError, TrackerError
from tracker.pipeline.automatic_run import StoredSession, open_stored_session
from tracker.session.assemble import DEFAULT_MODEL, NewSession, assemble
from tracker.session.session import Session, load_session
from tracker.validation import nfc_name

SessionOrFolder: TypeAlias = Session | str | Path
"""A session, or the path of its folder."""
PersonName: TypeAlias = str | None
"""Name of a person; None where a session has only one."""


def open_session(folder: SessionOrFolder) -> Session:
    """Return the session of a folder, with its cameras and the present bodies of its people.

    It is a value: it does not change when the folder does. All functions take it or the folder, and read that again.

    Args:
        folder: the session folder.

    Raises:
        SessionError: it is no session, or one of a newer version.
    """
    return load_session(folder.folder if isinstance(folder, Session) else folder)


def new_session(
    folder: str | Path,
    videos: Sequence[str | Path],
    calibration: str | Path,
    people: Sequence[str] = ("person",),
    *,
    background: str | Path | None = None,
    model: str = DEFAULT_MODEL,
    heights: Mapping[str, float] | float | None = None,
    fps: float | None = None,
    up: str = "z",
    offsets: Mapping[str, float] | None = None,
) -> Session:
    """Make a session of videos and a calibration. Nothing is written unless all of it fits.

    Args:
        folder: to make; must not exist, or be empty.
        videos: video files or folders of images, each named after its camera.
        calibration: file or folder of a layout that docs/log/recordings.md lists.
        people: names of the people.
        background: folder of CAM.png or CAM.mp4 of the empty scene.
        model: preset of a body, or a .toml file of one.
        heights: of all people or by name, metres; by default that of the model.
        fps: rate at which the cameras filmed, 1/s; by default as the videos declare.
        up: world axis that points up.
        offsets: by camera; frame k of the session is frame k + offset of the camera.

    Raises:
        TrackerError: footage, calibration and names do not fit one another, or the folder cannot be written.
    """
    return assemble(
        NewSession(
            Path(folder),
            Path(calibration),
            [Path(video) for video in videos],
            background=None if background is None else Path(background),
            people=people,
            models=model,
            heights=heights,
            fps=fps,
            up=up,
            offsets=offsets or {},
        )
    )


def people_of(session: Session, names: Sequence[str] | None) -> tuple[int, ...]:
    """Return the indices of people by their names; None stands for all.

    Raises:
        SessionError: there is no such person.
    """
    known = [nfc_name(p.name) for p in session.people]
    if names is None:
        return tuple(range(len(known)))
    if isinstance(names, str):
        raise TypeError(f"expected a list of names, found the text '{names}'; write ['{names}']")
    unknown = [name for name in names if nfc_name(name) not in known]
    if unknown:
        listed = ", ".join(p.name for p in session.people)
        raise SessionError(f"expected people among {listed}, found '{unknown[0]}'; name one of them")
    return tuple(known.index(nfc_name(name)) for name in names)


def person_of(session: Session, name: PersonName) -> int:
    """Return the index of a person.

    Raises:
        SessionError: there is no such person, or a session of several needs a name.
    """
    if name is None and len(session.people) > 1:
        listed = ", ".join(p.name for p in session.people)
        raise SessionError(f"expected the name of a person, found none in a session of {listed}; name one of them")
    return people_of(session, None if name is None else [name])[0]


def frames_of(session: Session, frames: Sequence[int] | None) -> Sequence[int]:
    """Return frames, ascending; None stands for all.

    Raises:
        TrackerError: there are none, or one is not of the session.
    """
    wanted = range(session.n_frames) if frames is None else sorted({int(k) for k in frames})
    if not wanted or wanted[0] < 0 or wanted[-1] >= session.n_frames:
        asked = "none" if not wanted else f"{wanted[0]} to {wanted[-1]}"
        raise TrackerError(f"expected frames from 0 to {session.n_frames - 1}, found {asked}; correct them")
    steps = {b - a for a, b in pairwise(wanted)} or {1}
    return range(wanted[0], wanted[-1] + 1, steps.pop()) if len(steps) == 1 else wanted


@contextmanager
def opened(session: SessionOrFolder) -> Generator[StoredSession, None, None]:
    """Lock a session, and open its store and footage.

    Raises:
        TrackerError: another program has it open, or footage is missing.
    """
    with open_stored_session(open_session(session)) as stored:
        yield stored
