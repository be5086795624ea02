"""A batch on the workers of a running Dask cluster."""

import time
from pathlib import Path
from typing import Any

from app.runtime.progress import Reporter
from tracker.batch.manifest import Manifest
from tracker.errors import Remedy, TrackerError

_LOOK_S = 0.5
_CONNECT_S = 10


def run_on_cluster(manifest: Manifest, address: str, progress: Reporter) -> bool:
    """Do the tasks of a batch on a cluster whose workers see its folder; return whether Ctrl+C stopped it.

    A worker that dies gives its task back as any other does (`tracker.batch.claims`), to the workers that are left.

    Raises:
        TrackerError: the package `distributed` is missing, no scheduler answers, it goes away, or the workers fail.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise TrackerError(
            "expected the package distributed for --dask, found none", Remedy("install_extra", extra="dask")
        ) from error
    try:
        client = Client(address, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        raise TrackerError(
            f"expected a Dask scheduler at {address}, found none that answers; start it first"
        ) from error
    with client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise TrackerError(f"expected workers at {address}, found none; start some with dask worker {address}")
        progress.say(f"{len(manifest.tasks)} recordings, {threads} threads of workers")
        futures = list[Any]()
        try:
            _wait(manifest, futures, threads, client, progress)
        except KeyboardInterrupt:
            client.cancel(futures, force=True)
            return True
        except Exception as error:
            if client.status == "running":
                raise
            raise TrackerError(
                f"expected the Dask scheduler at {address} until all recordings have ended, found it gone; start it "
                "and run the batch again, which goes on where it was"
            ) from error
    return False


def work_once(folder: str) -> int:
    """Do one task of a batch, on a worker of the cluster; return the number of tasks done."""
    from tracker.batch.worker import work

    return work(Path(folder), max_tasks=1)


def _wait(manifest: Manifest, futures: list[Any], threads: int, client: Any, progress: Reporter) -> None:
    """Keep every thread of the cluster at work until all tasks have ended; `futures` are the calls under way."""
    shown = set[int]()
    while not manifest.is_finished():
        for task in manifest.tasks:
            if task.number not in shown and (result := manifest.result(task)) is not None:
                shown.add(task.number)
                progress.say(f"{len(shown)}/{len(manifest.tasks)} {task.recording.name}: {result.state}")
        for future in futures:
            _check(future)
        futures[:] = [f for f in futures if not f.done()]
        for _ in range(min(threads, manifest.n_parts()) - len(futures)):
            futures.append(client.submit(work_once, str(manifest.folder), pure=False))
        if client.status == "closed":
            raise ConnectionError("the client has lost its scheduler")
        time.sleep(_LOOK_S)


def _check(future: Any) -> None:
    """Refuse workers that cannot run this program. One that died gives its task back.

    Raises:
        TrackerError: a call has failed otherwise.
    """
    from distributed import KilledWorker

    if future.status == "error" and not isinstance(error := future.exception(), KilledWorker):
        raise TrackerError(
            "expected workers with this version of the program that can write the folder of the batch, found one that "
            f"fails with {type(error).__name__}: {error}; correct it and run the batch again"
        )
