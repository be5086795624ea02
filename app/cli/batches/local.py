"""Workers of a batch as processes of this machine."""

import os
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from app.cli.doctor import WORKER_BYTES
from app.runtime.progress import Reporter
from tracker.batch.manifest import Manifest
from tracker.errors import TrackerError
from tracker.system import free_bytes, n_cores, own_module, start_detached

_LOOK_S = 0.5
_END_S = 10.0
"""Time for the workers to store what they have after Ctrl+C, s."""


def run_locally(manifest: Manifest, wanted: int | None, progress: Reporter) -> bool:
    """Do the tasks of a batch by processes of this machine; return whether Ctrl+C stopped it.

    Args:
        manifest: of the batch.
        wanted: number of workers; as many as cores and memory allow by default.
        progress: shows a line for each task.

    Raises:
        TrackerError: the workers ended before the tasks, as on a full disk.
    """
    n_open = len(manifest.tasks) - sum(n for s, n in manifest.counts().items() if s in ("done", "failed"))
    n, note = n_workers(wanted, manifest.n_parts(), n_cores(), free_bytes())
    if note:
        progress.say(note)
    progress.say(f"{n_open} recordings, {n} {'worker' if n == 1 else 'workers'}")
    compile_kernels(progress)
    environment = {**os.environ, "QUADRILLE_THREADS": str(max(1, n_cores() // n))}
    folder = str(manifest.folder)
    words = [*own_module("quadrille"), "batch", folder, "--out", folder, "--work"]
    logs = manifest.folder / "logs"
    logs.mkdir(exist_ok=True)
    workers = list[subprocess.Popen[bytes]]()
    try:
        for number in range(n):
            with (logs / f"worker_{number}.txt").open("ab") as log:
                workers.append(start_detached(words, stdout=log, stderr=log, env=environment))
        _watch(manifest, workers, progress)
    except KeyboardInterrupt:
        _stop(workers)
        return True
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()
    if not manifest.is_finished():
        found = [line for log in sorted(logs.glob("*.txt")) for line in log.read_text("utf-8", "replace").splitlines()]
        last = f" that said: {found[-1]}" if found else ""
        raise TrackerError(
            f"expected workers until all recordings have ended, found none{last}; see that there are memory and room "
            f"for {manifest.folder}, and run the batch again, which goes on where it was"
        )
    return False


def n_workers(wanted: int | None, n_tasks: int, cores: int, free: int) -> tuple[int, str]:
    """Return a number of workers that memory allows, and a sentence where it is smaller than asked for.

    Args:
        wanted: number asked for; one for each core by default.
        n_tasks: number of tasks that are left, each stretch being one.
        cores: of the machine.
        free: memory that programs can still have, bytes.
    """
    asked = min(wanted or cores, max(1, n_tasks))
    allowed = max(1, free // WORKER_BYTES)
    if allowed >= asked:
        return asked, ""
    return allowed, (
        f"{allowed} of {asked} workers are started: each may need {WORKER_BYTES / 1e9:.1f} GB, and "
        f"{free / 1e9:.1f} GB are free"
    )


def work_here(folder: Path) -> None:
    """Do tasks in this process until none is left. SIGTERM and Ctrl+C give its task back."""
    from tracker.batch.worker import work

    stopped = list[int]()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda n, _: stopped.append(n))
    work(folder, is_stopped=lambda: bool(stopped))


def compile_kernels(progress: Reporter) -> None:
    """Compile missing kernels once, before workers would each do it."""
    from tracker.compute.kernel_cache import is_compiled

    if not is_compiled():
        progress.say("kernels that are not compiled yet are compiled first: it may take a minute or two")
        subprocess.run(own_module("app.bench.compile_kernels"), check=False)


def _watch(manifest: Manifest, workers: list[subprocess.Popen[bytes]], progress: Reporter) -> None:
    """Show each task and each stretch that ends, until all have, or no worker is left."""
    shown = set(manifest.ended_parts())
    n = len(manifest.tasks) - len(shown & {t.key for t in manifest.tasks})
    n_done = 0
    while n_done < n:
        ended = all(w.poll() is not None for w in workers)
        for key, (part, result) in manifest.ended_parts().items():
            if key not in shown:
                shown.add(key)
                n_done += part.stretch is None
                how = f"{result.seconds:.0f} s" if result.state == "done" else f"failed: {result.error}"
                progress.say(f"{n_done}/{n} {part.name}: {how}")
        if ended:
            return
        time.sleep(_LOOK_S)


def _stop(workers: list[subprocess.Popen[bytes]]) -> None:
    """Ask the workers to give their tasks back, and wait for them."""
    for worker in workers:
        worker.terminate()
    until = time.monotonic() + _END_S
    for worker in workers:
        with suppress(subprocess.TimeoutExpired):
            worker.wait(max(0.0, until - time.monotonic()))
