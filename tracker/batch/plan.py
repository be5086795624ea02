"""The plan of a batch: which recordings, and what to do with each. docs/batch.md describes the file."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
from msgspec import Meta

from tracker.batch.table import Footage, Problem, Table, matches, read_table
from tracker.errors import TrackerError
from tracker.formats.file_names import file_stems
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_toml
from tracker.session.folder import SESSION_FILE
from tracker.session.frame_list import parse_frame_list
from tracker.validation import FilePath, Name, check

if TYPE_CHECKING:
    from tracker.session.session import Session

FOLDER_FILE = "batch.toml"
"""Name of a file of settings for the recordings in its folder and below."""
_KIND = TextKind("plan", DOCUMENT_BYTES, TrackerError)


class Settings(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """Instructions for a recording. A value that is not given is inherited."""

    find: bool | None = None
    """Find people who have no pose; true by default."""
    acquire: bool | None = None
    """Acquire sizes of people whose bodies have those of a preset; true by default."""
    method: Literal["chamfer", "contour", "voxel"] | None = None
    options: dict[str, bool | float | str] | None = None
    """Of the method, by name."""
    frames: Annotated[str, Meta(pattern=r"^\d*:\d*\Z", description="frames as A:B")] | None = None
    stride: Annotated[int, Meta(ge=1, description="a whole number from 1")] | None = None
    keypoints: Name | None = None
    """Name of imported observations that are evidence too."""
    people: list[Name] | None = None
    """Names of those to track; all by default."""
    export: list[Name] | None = None
    """Formats to write the poses in."""
    stretch: Annotated[int, Meta(ge=0, description="a whole number from 0")] | None = None
    """Frames of a stretch at least, of those that are tracked: a recording of twice as many is cut. 0 for never. 1000
    by default (`tests/benchmarks/long_recording.py`): finding people in each stretch takes a tenth of the time."""
    attempts: Annotated[int, Meta(ge=1, description="a whole number from 1")] | None = None
    """Workers that may die over the recording before it counts as failed, so that it does not kill them all; 3 by
    default."""
    skip: bool | None = None
    """Leave the recording out."""

    @property
    def stretch_frames(self) -> int:
        """Frames of a stretch at least; 0 for a recording that is never cut."""
        return 1000 if self.stretch is None else self.stretch

    def over(self, other: "Settings") -> "Settings":
        """Return these settings, with those of another where they are not given. Options are merged one by one."""
        given = {f: v for f in self.__struct_fields__ if (v := getattr(self, f)) is not None}
        if self.options is not None:
            given["options"] = {**(other.options or {}), **self.options}
        return msgspec.structs.replace(other, **given)


class _FolderFile(msgspec.Struct, forbid_unknown_fields=True):
    settings: Settings = msgspec.field(default_factory=Settings)


class _PlanFile(msgspec.Struct, forbid_unknown_fields=True):
    sessions: list[Annotated[str, Meta(min_length=1, max_length=1000)]] = []
    """Session folders, as paths or patterns such as `lab/*/session`."""
    table: str | None = None
    """CSV file with a row for each recording to make a session of."""
    freeze_bodies: bool = False
    """Acquire each person's body once, and use it in all recordings with a person of that name."""
    settings: Settings = msgspec.field(default_factory=Settings)
    recordings: dict[str, Settings] = {}
    """Settings of single recordings, by name."""


@dataclass(frozen=True)
class PlannedRecording:
    """A recording of a plan."""

    name: str
    """Unique in the plan: the session's path below the plan, or its name in the table."""
    session: str
    """Absolute path of the session folder."""
    settings: Settings
    footage: Footage | None = None
    """To make the session of, if there is none."""


@dataclass(frozen=True)
class BatchPlan:
    """All recordings of a batch, without those that are left out."""

    path: Path
    recordings: tuple[PlannedRecording, ...]
    freeze_bodies: bool = False
    people: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the people of each recording that has a session, as far as it can be read."""
    n_frames: Mapping[str, int] = field(default_factory=dict)
    """Number of frames to track of each recording, as far as it is known."""
    problems: tuple[Problem, ...] = ()
    """Of patterns, of settings and of rows of the table."""
    unread: tuple[str, ...] = ()
    """Names of the columns of the table that are not read."""


def read_plan(path: Path, out: Path) -> BatchPlan:
    """Read a plan, and the settings of the folders on the way to each recording.

    Args:
        path: the TOML file.
        out: folder of the batch, where sessions of the table are made.

    Raises:
        TrackerError: the plan is malformed or names no recording, or its path has control characters: scripts have it.
    """
    path = path.resolve()
    for name, place in (("the plan", path), ("the folder of the batch", out)):
        check(str(place), FilePath, name, TrackerError)
    row = check(read_toml(path, _KIND), _PlanFile, f"plan {path}", TrackerError)
    table = Table({}, (), ()) if row.table is None else read_table(path.parent / row.table)
    folders = dict(zip(table.footage, file_stems([*table.footage]), strict=True))
    of_table = {name: (out / "sessions" / folders[name], footage) for name, footage in table.footage.items()}
    by_pattern, problems = _by_pattern(row, path)
    problems += table.problems
    for name in sorted(by_pattern.keys() & of_table.keys()):
        error = TrackerError("expected another name in the table than that of a session; change it")
        problems.append(Problem(f"plan {path}, '{name}'", error))
    footage_of = {**by_pattern, **of_table}
    if not footage_of and not problems:
        raise TrackerError(
            f"plan {path}: expected sessions or a table with recordings, found none; 'sessions' takes paths such as "
            f"lab/*/session, of folders with {SESSION_FILE}"
        )
    if not problems:  # which hide names
        known = ", ".join(sorted(footage_of))[:300]
        for name in sorted(row.recordings.keys() - footage_of.keys()):
            error = TrackerError(f"expected settings of recordings among {known}, found '{name}'; correct the name")
            problems.append(Problem(f"plan {path}", error))
    chosen = []
    for name, (session, footage) in sorted(footage_of.items()):
        settings_of_row = row.recordings.get(name, Settings())
        try:
            settings = settings_of_row.over(_inherited(path.parent, session, row.settings))
        except TrackerError as error:
            settings = settings_of_row.over(row.settings)
            if not settings.skip:
                problems.append(Problem(name, error))
        if not settings.skip:
            chosen.append(PlannedRecording(name, str(session), settings, footage))
    sessions = {r.name: _session_of(r) for r in chosen}
    people = {r.name: names for r in chosen if (names := _people_of(r, sessions[r.name]))}
    n_frames = {r.name: _n_frames(r, s) for r in chosen if (s := sessions[r.name]) is not None}
    return BatchPlan(path, tuple(chosen), row.freeze_bodies, people, n_frames, tuple(problems), table.unread)


def _by_pattern(row: _PlanFile, path: Path) -> tuple[dict[str, tuple[Path, Footage | None]], list[Problem]]:
    """Return the session folders that the patterns of a plan name, and problems of patterns."""
    folders_of, problems = dict[str, tuple[Path, Footage | None]](), list[Problem]()
    for pattern in row.sessions:
        try:
            folders = [p.resolve() for p in matches(path.parent, pattern) if p.is_dir()]
            if not folders:
                raise TrackerError(f"expected session folders at '{pattern}', found none; correct the path")
            for whole in folders:
                check(str(whole), FilePath, "a path", TrackerError)
                inside = whole.is_relative_to(path.parent)
                folders_of[(whole.relative_to(path.parent) if inside else whole).as_posix()] = (whole, None)
        except TrackerError as error:
            problems.append(Problem(f"plan {path}", error))
    return folders_of, problems


def _inherited(top: Path, session: Path, settings: Settings) -> Settings:
    """Return settings with those of the folders from the plan's down to the session, the innermost first."""
    folders = [p for p in (session, *session.parents) if p.is_relative_to(top)] if session.is_relative_to(top) else []
    for folder in reversed(folders):
        file = folder / FOLDER_FILE
        if file.is_file():
            row = check(read_toml(file, _KIND), _FolderFile, f"settings {file}", TrackerError)
            settings = row.settings.over(settings)
    return settings


def _session_of(recording: PlannedRecording) -> "Session | None":
    """Return the session of a recording; None where there is none or it cannot be read, which its task says."""
    from tracker.session.session import load_session

    if recording.footage is not None:
        return None
    try:
        return load_session(recording.session)
    except TrackerError:
        return None


def _people_of(recording: PlannedRecording, session: "Session | None") -> tuple[str, ...]:
    """Return the names of the people of a recording, as far as they are known."""
    if recording.footage is not None:
        return recording.footage.people
    return () if session is None else tuple(p.name for p in session.people)


def _n_frames(recording: PlannedRecording, session: "Session") -> int:
    """Return the number of frames of a recording that are tracked; 0 where the range is wrong, which its task says."""
    text = recording.settings.frames
    with suppress(TrackerError):
        frames = range(session.n_frames) if text is None else parse_frame_list(text, session.n_frames, "frames")
        return len(frames[:: recording.settings.stride or 1])
    return 0


def plain(recording: PlannedRecording) -> dict[str, Any]:
    """Return a recording as plain data for a file of tasks."""
    data: dict[str, Any] = msgspec.to_builtins(recording)
    return data
