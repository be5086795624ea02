"""The tasks of a batch on disk: one state each, changed by the worker that claimed it.

BATCH/tasks/000007.json     what to do, written once
BATCH/claims/000007         while a worker does it
BATCH/results/000007.json   once it is done or has failed
BATCH/bodies/NAME.toml      bodies that recordings share
BATCH/exports               files for other programs
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from tracker.batch import claims
from tracker.batch.claims import Claim
from tracker.batch.plan import BatchPlan, PlannedRecording, from_plain, plain
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.text_files import DOCUMENT_BYTES, TextKind, read_json

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


@dataclass(frozen=True)
class RecordingTask:
    """A recording to track."""

    number: int
    recording: PlannedRecording
    after: tuple[int, ...] = ()
    """Numbers of the tasks that must have ended before: those that acquire bodies which it shares."""
    bodies: tuple[str, ...] = ()
    """Names of the people whose bodies are shared."""

    @property
    def key(self) -> str:
        """Name of its files."""
        return f"{self.number:06d}"


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
            for name in ("tasks", "claims", "results", "attempts", "bodies", "exports", "sessions"):
                (folder / name).mkdir(parents=True, exist_ok=True)
            before = cls.load(folder).tasks if any((folder / "tasks").iterdir()) else ()
            if before and [t.recording.name for t in before] != [t.recording.name for t in tasks]:
                raise TrackerError(
                    f"expected the {len(before)} recordings of the batch in {folder}, found {len(tasks)} others in the "
                    "plan; choose another folder"
                )
            for task in tasks:
                data = {"recording": plain(task.recording), "after": list(task.after), "bodies": list(task.bodies)}
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
            tasks.append(RecordingTask(number, recording, after, bodies))
        return cls(folder, tasks)

    def result(self, task: RecordingTask) -> Result | None:
        """Return how a task ended; None if it has not."""
        try:
            return msgspec.json.decode((self.folder / "results" / f"{task.key}.json").read_bytes(), type=Result)
        except FileNotFoundError:
            return None

    def state(self, task: RecordingTask) -> State:
        """Return the state of a task."""
        if (found := self.result(task)) is not None:
            return found.state
        return "running" if claims.has_living(self._claim_path(task)) else "waiting"

    def counts(self) -> Counter[State]:
        """Return the number of tasks in each state."""
        return Counter(map(self.state, self.tasks))

    def claim_next(self) -> tuple[RecordingTask, Claim] | None:
        """Claim a task that can begin; None if there is none at present."""
        for task in self.tasks:
            if self.result(task) is not None or any(self.result(self.tasks[i]) is None for i in task.after):
                continue
            held = claims.claim(self._claim_path(task))
            if held is None:
                continue
            if self.result(task) is not None:  # it ended between the two looks
                held.release()
                continue
            return task, held
        return None

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
            (self.folder / "attempts" / task.key).unlink(missing_ok=True)
            (self.folder / "results" / f"{task.key}.json").unlink(missing_ok=True)
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
        tasks.append(RecordingTask(number, recording, tuple(after), tuple(shared)))
    return tasks
