"""The tasks of a batch on disk: one state each, changed by the worker that claimed it.

BATCH/tasks/000007.json     what to do, written once
BATCH/claims/000007         while a worker does it
BATCH/results/000007.json   once it is done or has failed
BATCH/stretches/000007.json the stretches of a long recording, once its people are found
BATCH/stretches/000007_003  the copy of the session in which a stretch is tracked

The task of a long recording is done in parts. Its first visit ends with the division. Then workers claim its stretches,
which have claims and results of their own, `000007_003`. Once all have ended, the last visit joins them.

BATCH/bodies/NAME.toml      bodies that recordings share
BATCH/exports/NAME          files of a recording for other programs

A file is known by its name. One that is damaged or missing fails its recording, and no other.
"""

import re
import shutil
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from tracker.batch import claims
from tracker.batch.claims import Claim
from tracker.batch.plan import BatchPlan, plain
from tracker.batch.stretches import Division, n_stretches
from tracker.batch.task_files import STRETCHES, RecordingTask, Result, damaged, missing_task, read_file, read_task
from tracker.errors import Remedy, TrackerError
from tracker.files import write_text_atomic
from tracker.formats.file_names import identifiers

State: TypeAlias = Literal["waiting", "running", "done", "failed"]
_FOLDERS = ("tasks", "claims", "results", "attempts", "bodies", "exports", "sessions", STRETCHES)


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
        if any((folder / "tasks").glob("*.json")):
            cls.load(folder)._check_same(tasks)
        manifest = cls(folder, tasks)
        manifest.make_folders()
        for task in tasks:
            data = {
                "recording": plain(task.recording),
                "after": task.after,
                "bodies": task.bodies,
                "stretches": task.n_expected,
                "stem": task.stem,
                "n_tasks": len(tasks),
            }
            manifest._write(folder / "tasks" / f"{task.key}.json", data)
        return manifest

    @classmethod
    def load(cls, folder: Path, plan: BatchPlan | None = None) -> "Manifest":
        """Read the tasks of a batch.

        Args:
            folder: of the batch.
            plan: as it is now; without one, the tasks have the settings of the plan that was run last.

        Raises:
            TrackerError: it is not the folder of a batch, or that of another plan.
        """
        paths = (folder / "tasks").glob("*.json") if (folder / "tasks").is_dir() else []
        files = {int(p.stem): p for p in paths if re.fullmatch(r"[0-9]{6}", p.stem)}
        if not files:
            raise TrackerError(f"expected the folder of a batch, found no tasks in {folder}; name the right folder")
        rows = {number: read_task(number, path) for number, path in files.items()}
        n_tasks = max((n for _, n in rows.values() if n), default=max(files) + 1)
        manifest = cls(folder, [rows[i][0] if i in rows else missing_task(i, folder) for i in range(n_tasks)])
        if plan is not None:
            now = _tasks(plan)
            manifest._check_same(now)
            manifest.tasks = tuple(a if a.damage else b for a, b in zip(manifest.tasks, now, strict=True))
        return manifest

    def _check_same(self, tasks: Sequence[RecordingTask]) -> None:
        """Refuse tasks that are not of the recordings of this batch, as far as its files can be read.

        Raises:
            TrackerError: there are others.
        """
        known = {t.number: t.recording.name for t in self.tasks if not t.damage}
        if len(self.tasks) != len(tasks) or any(name != tasks[i].recording.name for i, name in known.items()):
            raise TrackerError(
                f"expected the {len(self.tasks)} recordings of the batch in {self.folder}, found {len(tasks)} others "
                "in the plan; choose another folder"
            )

    def make_folders(self) -> None:
        """Make the folders of the batch that are missing.

        Raises:
            TrackerError: they cannot be written.
        """
        try:
            for name in _FOLDERS:
                (self.folder / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unwritable(self.folder, error) from error

    def result(self, task: RecordingTask) -> Result | None:
        """Return how a task ended; None if it has not. A task with a damaged file has failed."""
        try:
            result = read_file(self.folder / "results" / f"{task.key}.json", Result)
        except TrackerError as error:
            return damaged(str(error), error.remedy)
        is_whole = task.division is None and task.stretch is None
        damage = self.with_stretches(task).damage if result is None and is_whole else task.damage
        return damaged(damage, None if task.damage else Remedy("do_again")) if damage else result

    def with_stretches(self, task: RecordingTask) -> RecordingTask:
        """Return the task of a recording with its stretches, if it has some by now."""
        try:
            division = None if task.damage else read_file(self.folder / STRETCHES / f"{task.key}.json", Division)
        except TrackerError as error:
            return replace(task, damage=str(error))
        return replace(task, division=division)

    def state(self, task: RecordingTask) -> State:
        """Return the state of a task. A recording is running while one of its stretches is."""
        if (found := self.result(task)) is not None:
            return found.state
        parts = [task, *self.with_stretches(task).stretches()]
        return "running" if any(claims.has_living(self._claim_path(part)) for part in parts) else "waiting"

    def counts(self) -> Counter[State]:
        """Return the number of tasks in each state."""
        return Counter(map(self.state, self.tasks))

    def claim_next(self) -> tuple[RecordingTask, Claim] | None:
        """Claim a task that can begin, or a stretch of one; None if there is none at present."""
        for task in self.tasks:
            if self.result(task) is not None or not all(self._has_bodies(self.tasks[i]) for i in task.after):
                continue
            task = self.with_stretches(task)
            parts = task.stretches()
            ended = [self.result(part) for part in parts]
            waiting = [part for part, result in zip(parts, ended, strict=True) if result is None]
            if parts and not waiting:
                failed = ((i, r.error) for i, r in enumerate(ended) if r is not None and r.state == "failed")
                task = replace(task, failed=tuple(failed))
            for part in waiting or [task]:
                if (held := claims.claim(self._claim_path(part))) is None:
                    continue
                if self.result(part) is not None or self.with_stretches(task).division != task.division:
                    held.release()  # it ended, or was divided, between the two looks
                    continue
                return part, held
        return None

    def _has_bodies(self, task: RecordingTask) -> bool:
        """Return whether a recording has the bodies that others wait for, or failed to."""
        return self.result(task) is not None or self.with_stretches(task).division is not None

    def divide(self, task: RecordingTask, held: Claim, division: Division) -> bool:
        """Write the stretches of a recording, or their right names, and give up its claim.

        Returns:
            Whether they were written: False if another worker has taken the task since.
        """
        return self._hand_in(self.folder / STRETCHES / f"{task.key}.json", held, division)

    def spent_on_stretches(self, task: RecordingTask) -> tuple[float, float]:
        """Return the time that the stretches of a recording took, by the clock and of processors, s."""
        results = list[Result]()
        for path in sorted((self.folder / "results").glob(f"{task.key}_*.json")):
            with suppress(TrackerError):  # a damaged one has failed
                results += [result] if (result := read_file(path, Result)) else []
        return sum(r.seconds for r in results), sum(r.cpu_seconds for r in results)

    def n_parts(self) -> int:
        """Return how many tasks are left that workers can do side by side: recordings, and stretches of long ones."""
        n = 0
        for task in self.tasks:
            if self.result(task) is None:
                parts = self.with_stretches(task).stretches()
                n += max(1, sum(self.result(part) is None for part in parts)) if parts else task.n_expected
        return n

    def ended_parts(self) -> dict[str, tuple[RecordingTask, Result]]:
        """Return the tasks that have ended, and the stretches of long recordings, by their keys."""
        parts = (part for task in self.tasks for part in (*self.with_stretches(task).stretches(), task))
        return {part.key: (part, result) for part in parts if (result := self.result(part)) is not None}

    def is_finished(self) -> bool:
        """Return whether every task has ended."""
        return all(self.result(task) is not None for task in self.tasks)

    def count_attempt(self, task: RecordingTask) -> int:
        """Note that a worker begins a task; return how many have."""
        path = self.folder / "attempts" / task.key
        with path.open("a", encoding="utf-8") as file:
            file.write("begun\n")
        return len(path.read_bytes().splitlines())

    def forget_attempt(self, task: RecordingTask) -> None:
        """Take the last attempt back: its worker was stopped, and did not die of the task."""
        path = self.folder / "attempts" / task.key
        write_text_atomic(path, "".join(path.read_text("utf-8").splitlines(keepends=True)[1:]))

    def finish(self, task: RecordingTask, held: Claim, result: Result) -> bool:
        """Write the result of a task, and give up its claim.

        Returns:
            Whether it was written: False if another worker has taken the task since.
        """
        result = msgspec.structs.replace(result, settings=task.recording.settings)
        return self._hand_in(self.folder / "results" / f"{task.key}.json", held, result)

    def _hand_in(self, path: Path, held: Claim, data: object) -> bool:
        """Write a file of a task and give up its claim, unless another worker has taken it; return whether it did."""
        if not held.is_held():
            return False
        self._write(path, data)
        held.release()
        return True

    def retry(self) -> int:
        """Make failed tasks wait again; return their number."""
        failed = [task for task in self.tasks if (found := self.result(task)) and found.state == "failed"]
        try:
            for task in failed:
                divided = self.with_stretches(task)
                if divided.damage:  # its stretches would be taken for those of the next division
                    self._forget_stretches(task)
                for part in [*divided.stretches(), task]:
                    if (found := self.result(part)) is None or found.state == "failed":
                        (self.folder / "attempts" / part.key).unlink(missing_ok=True)
                        (self.folder / "results" / f"{part.key}.json").unlink(missing_ok=True)
        except OSError as error:
            raise _unwritable(self.folder, error) from error
        return len(failed)

    def _forget_stretches(self, task: RecordingTask) -> None:
        """Remove the division of a recording, its copies of the session and their results."""
        for path in (self.folder / STRETCHES).glob(f"{task.key}_*"):
            shutil.rmtree(path)
        for name in (f"results/{task.key}_*.json", f"attempts/{task.key}_*", f"{STRETCHES}/{task.key}.json"):
            for path in self.folder.glob(name):
                path.unlink()

    def _write(self, path: Path, data: object) -> None:
        """Write a file of the batch.

        Raises:
            TrackerError: it cannot be written.
        """
        try:
            write_text_atomic(path, msgspec.json.format(msgspec.json.encode(data)).decode())
        except OSError as error:
            raise _unwritable(path, error) from error

    def _claim_path(self, task: RecordingTask) -> Path:
        return self.folder / "claims" / task.key


def ended_names(folder: Path, retry: bool) -> set[str]:
    """Return the names of the recordings of a batch that are not tracked any more; none before it has begun.

    Args:
        folder: of the batch.
        retry: whether those that failed are tracked again.
    """
    with suppress(TrackerError):
        manifest = Manifest.load(folder)
        states = ("done",) if retry else ("done", "failed")
        return {task.recording.name for task in manifest.tasks if manifest.state(task) in states}
    return set()


def _tasks(plan: BatchPlan) -> list[RecordingTask]:
    """Return a task for each recording. Of people with shared bodies, the first recording acquires the body."""
    tasks, first = list[RecordingTask](), dict[str, int]()
    stems = identifiers([r.name for r in plan.recordings])
    for number, (recording, stem) in enumerate(zip(plan.recordings, stems, strict=True)):
        people = plan.people.get(recording.name, ())
        wanted = recording.settings.people
        shared = [p for p in people if wanted is None or p in wanted] if plan.freeze_bodies else []
        after = sorted({first[p] for p in shared if p in first})
        for person in shared:
            first.setdefault(person, number)
        n_expected = n_stretches(plan.n_frames.get(recording.name, 0), recording.settings.stretch_frames)
        tasks.append(RecordingTask(number, recording, tuple(after), tuple(shared), n_expected, stem=stem))
    return tasks


def _unwritable(path: Path, error: OSError) -> TrackerError:
    reason = error.strerror or str(error)
    return TrackerError(f"cannot write {path}: {reason}; choose a folder that you may write to, with room")
