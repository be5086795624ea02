"""A worker: claims tasks one after the other, and does them. All ways to run a batch call `work`."""

import logging
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import msgspec

from tracker.batch.claims import BEAT_S, Claim
from tracker.batch.manifest import Manifest
from tracker.batch.stretches import Division
from tracker.batch.task_files import RecordingTask, Result
from tracker.batch.tasks import Done, do_task
from tracker.compute.threads import one_blas_thread
from tracker.errors import TrackerError

_LOG = logging.getLogger(__name__)


Work: TypeAlias = Callable[[RecordingTask, Path, Callable[[str, float], None]], Done | Division]
"""Does a task in the folder of a batch, and reports its progress."""


class LostClaimError(Exception):
    """Another worker has taken the task, because this one showed no sign of life."""


def work(
    folder: Path, max_tasks: int | None = None, do: Work = do_task, is_stopped: Callable[[], bool] = lambda: False
) -> int:
    """Do tasks of a batch until all have ended.

    Args:
        folder: of the batch.
        max_tasks: number of tasks after which it ends, each stretch being one; None for no limit.
        do: does a task.
        is_stopped: asked at each step; its task is then given back, and goes on where it was later.

    Returns:
        Number of tasks that this worker has ended.
    """
    import scipy.linalg  # noqa: F401  before its threads are limited, which every task would load

    manifest, n_done = Manifest.load(folder), 0
    manifest.make_folders()
    with one_blas_thread():  # a worker has its share of the cores already
        while not is_stopped() and (max_tasks is None or n_done < max_tasks) and not manifest.is_finished():
            claimed = manifest.claim_next()
            if claimed is None:
                time.sleep(BEAT_S)
                continue
            try:
                n_done += _do(manifest, *claimed, do, is_stopped)
            except InterruptedError:
                break
    return n_done


def _do(manifest: Manifest, task: RecordingTask, held: Claim, do: Work, is_stopped: Callable[[], bool]) -> bool:
    """Do one task; return whether its result was written."""
    if held.dead is not None:
        held.free_session(task.session(manifest.folder))
    began, cpu = time.monotonic(), time.process_time()

    def go_on(stage: str, share: float) -> None:
        if is_stopped():
            raise InterruptedError
        if not held.is_held():
            raise LostClaimError

    def used(*before: tuple[float, float]) -> dict[str, float]:
        taken = [(time.monotonic() - began, time.process_time() - cpu), *before]
        if task.division is not None and task.stretch is None:
            taken.append((task.division.seconds, task.division.cpu_seconds))
        return {"seconds": sum(s for s, _ in taken), "cpu_seconds": sum(s for _, s in taken)}

    def end(result: Result) -> bool:
        who, times = f"{socket.gethostname()} {os.getpid()}", used(manifest.spent_on_stretches(task))
        return manifest.finish(task, held, msgspec.structs.replace(result, worker=who, **times))

    try:
        allowed = task.recording.settings.attempts or 3
        if manifest.count_attempt(task) > allowed:
            error = f"{allowed} workers died over it; look at memory and room on the disk, and track it alone"
            return end(Result("failed", error=error))
        with held.beating():
            done = do(task, manifest.folder, go_on)
    except LostClaimError:
        _LOG.warning("%s was taken by another worker; this one goes on with the next task", task.name)
        return False
    except (InterruptedError, KeyboardInterrupt):
        manifest.forget_attempt(task)
        held.release()
        raise
    except Exception as error:  # one recording must not end the others
        return end(_failed(task, error))
    if isinstance(done, Division):
        manifest.forget_attempt(task)
        return manifest.divide(task, held, msgspec.structs.replace(done, **used()))
    return end(
        Result(
            "done",
            first_pose=done.tracked.first_frame,
            statuses={name: dict(counts) for name, counts in done.tracked.statuses.items()},
            contradiction=done.tracked.contradiction,
            files=[str(path.relative_to(manifest.folder)) for path in done.files],
            n_stretches=1 if task.stretch is not None else max(1, len(task.stretches())),
            seams=list(done.seams),
        )
    )


def _failed(task: RecordingTask, error: Exception) -> Result:
    """Return the result of a task that ended with an error."""
    if isinstance(error, TrackerError):
        remedy = error.remedy
        fields = {} if remedy is None else {k: str(v) for k, v in remedy.fields.items()}
        return Result("failed", error=str(error), remedy="" if remedy is None else remedy.code, remedy_fields=fields)
    _LOG.error("%s failed", task.name, exc_info=error)
    if isinstance(error, OSError):
        text = f"cannot read or write: {error}; see that there is room, and that you may write"
    else:
        text = f"internal error: {type(error).__name__}: {error}; please report it with the log"
    return Result("failed", error=text)
