"""The files of the tasks of a batch: a task, the result of one, and reading them with checks."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta

from tracker.batch.plan import PlannedRecording, Settings
from tracker.batch.stretches import Division, RecordingStretch, SeamRow
from tracker.errors import Remedy, TrackerError
from tracker.files import read_regular
from tracker.formats.file_names import own_identifier
from tracker.formats.text_files import DOCUMENT_BYTES, TABLE_BYTES, TextKind, read_json
from tracker.validation import FileStem, check

T = TypeVar("T")

STRETCHES = "stretches"
"""Folder of the divisions and of the copies of sessions."""
_KIND = TextKind("task", DOCUMENT_BYTES, TrackerError, "run the batch again with its plan, which writes it")


class Result(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The end of a task."""

    state: Literal["done", "failed"]
    worker: str = ""
    """Host and process."""
    seconds: float = 0.0
    """By the clock."""
    cpu_seconds: float = 0.0
    """Processor time of the worker."""
    first_pose: int | None = None
    """Frame that tracking went out from."""
    statuses: dict[str, dict[str, int]] = {}
    """Number of frames by person and status."""
    contradiction: str = ""
    """A sentence on a camera that seems off; empty without one."""
    files: list[str] = []
    """Exported files, by their paths below the folder of the batch."""
    error: str = ""
    """Why it failed, for people; empty if it is done."""
    remedy: str = ""
    """Code of `tracker.errors.Remedy`; empty without one."""
    remedy_fields: dict[str, str] = {}
    n_stretches: int = 1
    """Number of stretches that the recording was cut into."""
    seams: list[SeamRow] = []
    """The frames at which they were joined."""
    settings: Settings | None = None
    """Instructions that were followed; None in results of older programs."""


@dataclass(frozen=True)
class RecordingTask:
    """A recording to track."""

    number: int
    recording: PlannedRecording
    after: tuple[int, ...] = ()
    """Numbers of the tasks that must have ended before: those that acquire bodies which it shares."""
    bodies: tuple[str, ...] = ()
    """Names of the people whose bodies are shared."""
    n_expected: int = 1
    """Number of stretches that it is expected to have."""
    division: Division | None = None
    """The stretches of a long recording; None before it is divided, and for a short one."""
    stretch: RecordingStretch | None = None
    """The stretch that is to be tracked; None for the recording itself."""
    failed: tuple[tuple[int, str], ...] = ()
    """Stretches that failed, by number, with the reason."""
    stem: str = ""
    """Name of its folder of exports, which no other task has."""
    damage: str = ""
    """Why its files cannot be used, for people; empty if they can."""

    @property
    def key(self) -> str:
        """Name of its files."""
        return f"{self.number:06d}" if self.stretch is None else f"{self.number:06d}_{self.stretch.key}"

    @property
    def name(self) -> str:
        """Name of what is tracked, for people."""
        if self.stretch is None:
            return self.recording.name
        return f"{self.recording.name}, frames {self.stretch.first}:{self.stretch.last + 1}"

    def session(self, batch: Path) -> Path:
        """Return the session folder in which poses are stored while the task is done."""
        return Path(self.recording.session) if self.stretch is None else batch / STRETCHES / self.key

    def stretches(self) -> list["RecordingTask"]:
        """Return the tasks of its stretches; none before it is divided."""
        if self.division is None:
            return []
        return [replace(self, stretch=s) for s in self.division.stretches]


class _TaskRow(msgspec.Struct, frozen=True):
    """The content of a file of `tasks`."""

    recording: PlannedRecording
    after: tuple[Annotated[int, Meta(ge=0)], ...]
    bodies: tuple[str, ...]
    stretches: Annotated[int, Meta(ge=1)] = 1
    stem: FileStem | None = None
    n_tasks: Annotated[int, Meta(ge=1, le=999_999)] | None = None
    """Number of tasks of the batch; None in those of older programs."""


def read_task(number: int, path: Path) -> tuple[RecordingTask, int | None]:
    """Return a task, and the number of tasks of its batch as far as the file has it. A damaged one says so."""
    try:
        row: _TaskRow = check(read_json(path, _KIND), _TaskRow, f"task {path}", TrackerError)
    except TrackerError as error:
        return replace(missing_task(number, path.parents[1]), damage=str(error)), None
    if any(other >= number for other in row.after):
        damage = f"task {path}: expected earlier tasks as 'after', found {max(row.after)}; {_KIND.remedy}"
        return replace(missing_task(number, path.parents[1]), damage=damage), row.n_tasks
    stem = row.stem or own_identifier(row.recording.name)
    return RecordingTask(number, row.recording, row.after, row.bodies, row.stretches, stem=stem), row.n_tasks


def missing_task(number: int, folder: Path) -> RecordingTask:
    """Return the task of a recording whose file is missing."""
    task = RecordingTask(number, PlannedRecording(f"task {number:06d}", "", Settings()))
    path = folder / "tasks" / f"{task.key}.json"
    return replace(task, damage=f"expected the file of a task, found none at {path}; {_KIND.remedy}")


def read_file(path: Path, declaration: type[T]) -> T | None:
    """Return the content of a file that a worker wrote; None if it is missing.

    Raises:
        TrackerError: it is damaged.
    """
    try:
        return msgspec.json.decode(read_regular(path, TABLE_BYTES), type=declaration)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.DecodeError, RecursionError) as error:
        raise TrackerError(
            f"{path} is damaged: {getattr(error, 'strerror', None) or error}", Remedy("do_again")
        ) from error


def damaged(damage: str, remedy: Remedy | None) -> Result:
    """Return the result of a task with a damaged file."""
    return Result("failed", error=damage, remedy="" if remedy is None else remedy.code)
