"""The tasks of a batch on disk: one state each, changed by the worker that claimed it.

BATCH/tasks/000007.json     what to do, written once
BATCH/claims/000007         while a worker does it
BATCH/results/000007.json   once it is done or has failed
BATCH/stretches/000007.json the stretches of a long recording, once its people are found
BATCH/stretches/000007_003  the copy of the session in which a stretch is tracked

The task of a long recording is done in parts. Its first visit ends with the division. Then workers claim its stretches,
which have claims and results of their own, `000007_003`. Once all have ended, the last visit joins them.

BATCH/bodies/NAME.toml      bodies that recordings share
BATCH/exports               files for other programs
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from tracker.batch import claims
from tracker.batch.claims import Claim
from tracker.batch.plan import BatchPlan, PlannedRecording, from_plain, plain
from tracker.batch.stretches import Division, RecordingStretch, SeamRow, n_stretches
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.text_files import DOCUMENT_BYTES, TextKind, read_json

STRETCHES = "stretches"
"""Folder of the divisions and of the copies of sessions."""
State: TypeAlias = Literal["waiting", "running", "done", "failed"]
_KIND = TextKind("task", DOCUMENT_BYTES, TrackerError, "make the batch again in another folder")


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


class Manifest:
    """The folder of a batch."""

    def __init__(self, folder: Path, tasks: Sequence[RecordingTask]) -> None:
        """Use `create` or `load`."""
        self.folder, self.tasks = folder, tuple(tasks)

    @classmethod
    def create(cls, plan: BatchPlan, folder: Path) -> "Manifest":
        """Write the tasks of a plan. Tasks of the same recordings that a batch already has keep their state.

        Raises:
            TrackerError: the folder is that of another batch, or cannot be written.
        """
        tasks = _tasks(plan)
        try:
            for name in ("tasks", "claims", "results", "attempts", "bodies", "exports", "sessions", STRETCHES):
                (folder / name).mkdir(parents=True, exist_ok=True)
            before = cls.load(folder).tasks if any((folder / "tasks").iterdir()) else ()
            if before and [t.recording.name for t in before] != [t.recording.name for t in tasks]:
                raise TrackerError(
                    f"expected the {len(before)} recordings of the batch in {folder}, found {len(tasks)} others in the "
                    "plan; choose another folder"
                )
            for task in tasks:
                data = {
                    "recording": plain(task.recording),
                    "after": list(task.after),
                    "bodies": list(task.bodies),
                    "stretches": task.n_expected,
                }
                write_text_atomic(folder / "tasks" / f"{task.key}.json", msgspec.json.encode(data).decode())
        except OSError as error:
            raise TrackerError(f"cannot write {folder}: {error.strerror}; choose another folder") from error
        return cls(folder, tasks)

    @classmethod
    def load(cls, folder: Path) -> "Manifest":
        """Read the tasks of a batch.

        Raises:
            TrackerError: it is not the folder of a batch.
        """
        files = sorted((folder / "tasks").glob("*.json")) if (folder / "tasks").is_dir() else []
        if not files:
            raise TrackerError(f"expected the folder of a batch, found no tasks in {folder}; name the right folder")
        tasks = []
        for number, file in enumerate(files):
            data = read_json(file, _KIND)
            try:
                recording, after, bodies = from_plain(data["recording"]), tuple(data["after"]), tuple(data["bodies"])
            except (KeyError, TypeError) as error:
                raise TrackerError(f"task {file}: expected recording, after and bodies, found other keys") from error
            tasks.append(RecordingTask(number, recording, after, bodies, data.get("stretches", 1)))
        return cls(folder, tasks)

    def result(self, task: RecordingTask) -> Result | None:
        """Return how a task ended; None if it has not."""
        try:
            return msgspec.json.decode((self.folder / "results" / f"{task.key}.json").read_bytes(), type=Result)
        except FileNotFoundError:
            return None

    def divided(self, task: RecordingTask) -> RecordingTask:
        """Return the task of a recording with its stretches, if it has some by now."""
        try:
            text = (self.folder / STRETCHES / f"{task.key}.json").read_bytes()
        except FileNotFoundError:
            return task
        return replace(task, division=msgspec.json.decode(text, type=Division))

    def state(self, task: RecordingTask) -> State:
        """Return the state of a task. A recording is running while one of its stretches is."""
        if (found := self.result(task)) is not None:
            return found.state
        parts = [task, *self.divided(task).stretches()]
        return "running" if any(claims.has_living(self._claim_path(part)) for part in parts) else "waiting"

    def counts(self) -> Counter[State]:
        """Return the number of tasks in each state."""
        return Counter(map(self.state, self.tasks))

    def claim_next(self) -> tuple[RecordingTask, Claim] | None:
        """Claim a task that can begin, or a stretch of one; None if there is none at present."""
        for task in self.tasks:
            if self.result(task) is not None or not all(self._has_bodies(self.tasks[i]) for i in task.after):
                continue
            task = self.divided(task)
            parts = task.stretches()
            ended = [self.result(part) for part in parts]
            waiting = [part for part, result in zip(parts, ended, strict=True) if result is None]
            if parts and not waiting:
                failed = ((i, r.error) for i, r in enumerate(ended) if r is not None and r.state == "failed")
                task = replace(task, failed=tuple(failed))
            for part in waiting or [task]:
                if (held := claims.claim(self._claim_path(part))) is None:
                    continue
                if self.result(part) is not None or self.divided(task).division != task.division:
                    held.release()  # it ended, or was divided, between the two looks
                    continue
                return part, held
        return None

    def _has_bodies(self, task: RecordingTask) -> bool:
        """Return whether a recording has the bodies that others wait for, or failed to."""
        return self.result(task) is not None or self.divided(task).division is not None

    def divide(self, task: RecordingTask, held: Claim, division: Division) -> bool:
        """Write the stretches of a recording, or their right names, and give up its claim.

        Returns:
            Whether they were written: False if another worker has taken the task since.
        """
        if not held.is_held():
            return False
        text = msgspec.json.format(msgspec.json.encode(division)).decode()
        write_text_atomic(self.folder / STRETCHES / f"{task.key}.json", text)
        held.release()
        return True

    def spent_on_stretches(self, task: RecordingTask) -> tuple[float, float]:
        """Return the time that the stretches of a recording took, by the clock and of processors, s."""
        found = [
            msgspec.json.decode(path.read_bytes(), type=Result)
            for path in sorted((self.folder / "results").glob(f"{task.key}_*.json"))
        ]
        return sum(r.seconds for r in found), sum(r.cpu_seconds for r in found)

    def n_parts(self) -> int:
        """Return how many tasks are left that workers can do side by side: recordings, and stretches of long ones."""
        n = 0
        for task in self.tasks:
            if self.result(task) is None:
                parts = self.divided(task).stretches()
                n += max(1, sum(self.result(part) is None for part in parts)) if parts else task.n_expected
        return n

    def ended_parts(self) -> dict[str, tuple[RecordingTask, Result]]:
        """Return the tasks that have ended, and the stretches of long recordings, by their keys."""
        parts = (part for task in self.tasks for part in (*self.divided(task).stretches(), task))
        return {part.key: (part, result) for part in parts if (result := self.result(part)) is not None}

    def is_finished(self) -> bool:
        """Return whether every task has ended."""
        return all(self.result(task) is not None for task in self.tasks)

    def count_attempt(self, task: RecordingTask) -> int:
        """Note that a worker begins a task; return how many have."""
        path = self.folder / "attempts" / task.key
        with path.open("a", encoding="utf-8") as file:
            file.write("begun\n")
        return len(path.read_text("utf-8").splitlines())

    def forget_attempt(self, task: RecordingTask) -> None:
        """Take the last attempt back: its worker was stopped, and did not die of the task."""
        path = self.folder / "attempts" / task.key
        write_text_atomic(path, "".join(path.read_text("utf-8").splitlines(keepends=True)[1:]))

    def finish(self, task: RecordingTask, held: Claim, result: Result) -> bool:
        """Write the result of a task, and give up its claim.

        Returns:
            Whether it was written: False if another worker has taken the task since.
        """
        if not held.is_held():
            return False
        path = self.folder / "results" / f"{task.key}.json"
        write_text_atomic(path, msgspec.json.format(msgspec.json.encode(result)).decode())
        held.release()
        return True

    def retry(self) -> int:
        """Make failed tasks wait again; return their number."""
        failed = [task for task in self.tasks if (found := self.result(task)) and found.state == "failed"]
        for task in failed:
            for part in [*self.divided(task).stretches(), task]:
                if (found := self.result(part)) is None or found.state == "failed":
                    (self.folder / "attempts" / part.key).unlink(missing_ok=True)
                    (self.folder / "results" / f"{part.key}.json").unlink(missing_ok=True)
        return len(failed)

    def _claim_path(self, task: RecordingTask) -> Path:
        return self.folder / "claims" / task.key


def _tasks(plan: BatchPlan) -> list[RecordingTask]:
    """Return a task for each recording. Of people with shared bodies, the first recording acquires the body."""
    tasks, first = list[RecordingTask](), dict[str, int]()
    for number, recording in enumerate(plan.recordings):
        people = plan.people.get(recording.name, ())
        wanted = recording.settings.people
        shared = [p for p in people if wanted is None or p in wanted] if plan.freeze_bodies else []
        after = sorted({first[p] for p in shared if p in first})
        for person in shared:
            first.setdefault(person, number)
        n_expected = n_stretches(plan.n_frames.get(recording.name, 0), recording.settings.stretch_frames)
        tasks.append(RecordingTask(number, recording, tuple(after), tuple(shared), n_expected))
    return tasks
