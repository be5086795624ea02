"""A worker: claims tasks one after the other, and does them. All ways to run a batch call `work`.

Do a task: make the session if there is none, give it the bodies that are known, track it, write its files.

A long recording is begun, tracked in stretches, and joined.
"""

import hashlib
import logging
import os
import shutil
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import msgspec

from tracker.api.results import export
from tracker.api.sessions import frames_of, open_session
from tracker.api.work import Progress, Tracked, track
from tracker.batch.checks import frames_to_track
from tracker.batch.claims import BEAT_S, Claim
from tracker.batch.join import TrackedStretch, join
from tracker.batch.manifest import Manifest
from tracker.batch.plan import PlannedRecording, plain
from tracker.batch.stretch_work import begin, track_stretch
from tracker.batch.stretches import Division, SeamRow, n_stretches
from tracker.batch.task_files import RecordingTask, Result
from tracker.compute.threads import one_blas_thread
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.formats.file_names import own_identifier
from tracker.formats.model_toml import format_model, has_preset_proportions, load_model
from tracker.interchange.exports.formats import FORMATS
from tracker.pipeline.body_acquisition import store_body
from tracker.session.assemble import assemble
from tracker.session.lock import SessionLock
from tracker.session.session import ANNOTATIONS_FILE, Session, load_session
from tracker.session.store.annotation_store import AnnotationStore

_TRACKED = "batch"
"""Setting of the session: the task that tracked it, and what it found. The same task does not track again."""


class Done(NamedTuple):
    """The results of a task."""

    tracked: Tracked
    files: tuple[Path, ...]
    """Exported files."""
    seams: tuple[SeamRow, ...] = ()
    """The frames at which stretches of a long recording were joined."""


@dataclass(frozen=True)
class TrackedBefore:
    """The results of tracking, as the setting `_TRACKED` keeps them."""

    tracked: Tracked
    seams: tuple[SeamRow, ...] = ()


def do_task(task: RecordingTask, folder: Path, progress: Progress) -> Done | Division:
    """Track a recording as its settings say, or a stretch of one. A task that was interrupted goes on where it was.

    Args:
        task: to do; the caller has claimed it.
        folder: of the batch.
        progress: receives the progress. An exception that it raises ends the work.

    Returns:
        The results; of a long recording its stretches, which are to be tracked before it is done again.

    Raises:
        TrackerError: the recording cannot be tracked or exported.
    """
    recording, settings = task.recording, task.recording.settings
    session, at = _session(recording), task.session(folder)
    key = _digest(task)
    tracked = _tracked_before(at, key)
    if tracked is None and task.stretch is not None:
        assert task.division is not None
        tracked = TrackedBefore(track_stretch(session, at, settings, task.division, task.stretch, progress))
    elif tracked is None and task.division is not None:
        joined = join(session, task.division, _parts(task, folder), key, progress)
        if isinstance(joined, Division):
            return joined
        tracked = TrackedBefore(joined.tracked, joined.seams)
    elif tracked is None:
        session = _with_known_bodies(session, task, folder / "bodies")
        frames = frames_of(session, frames_to_track(settings, session))[:: settings.stride or 1]
        if isinstance(frames, range) and n_stretches(len(frames), settings.stretch_frames) > 1:
            division = begin(session, settings, frames, progress)
            _share_bodies(load_session(session.folder), task, folder / "bodies")
            return division
        tracked = TrackedBefore(_track(session, recording, frames, progress))
    with SessionLock(at), AnnotationStore(at / session.annotations_path.name) as store:
        store.set_setting(_TRACKED, {"task": key, **msgspec.to_builtins(tracked)})
    if task.stretch is not None:
        return Done(tracked.tracked, ())
    _require_all(task)
    for part in task.stretches():
        shutil.rmtree(part.session(folder), ignore_errors=True)
    _share_bodies(load_session(session.folder), task, folder / "bodies")
    return Done(tracked.tracked, _export(session, task, folder / "exports"), tracked.seams)


def _digest(task: RecordingTask) -> str:
    """Return a text that identifies what a task does."""
    part = [] if task.stretch is None else [msgspec.to_builtins(task.stretch)]
    return hashlib.sha256(msgspec.json.encode([plain(task.recording), *part])).hexdigest()


def _track(session: Session, recording: PlannedRecording, frames: Sequence[int], progress: Progress) -> Tracked:
    settings = recording.settings
    return track(
        session,
        settings.people,
        frames,
        method=settings.method or "chamfer",
        options=settings.options,
        find_missing=settings.find is not False,
        acquire_sizes=settings.acquire is not False,
        keypoints=settings.keypoints,
        progress=progress,
    )


def _parts(task: RecordingTask, folder: Path) -> list[TrackedStretch]:
    """Return the stretches of a recording that were tracked.

    Raises:
        TrackerError: all of them failed.
    """
    parts = list[TrackedStretch]()
    for part in task.stretches():
        tracked = _tracked_before(part.session(folder), _digest(part))
        if tracked is not None and part.stretch is not None:
            parts.append(TrackedStretch(part.stretch, part.session(folder), tracked.tracked))
    if not parts:
        _require_all(task)
    return parts


def _require_all(task: RecordingTask) -> None:
    """Refuse a recording of which a stretch failed, after the poses of the others are stored.

    Raises:
        TrackerError: a stretch failed.
    """
    if not task.failed:
        return
    parts = {part.stretch.number: part.stretch for part in task.stretches() if part.stretch is not None}
    lost = ", ".join(f"{parts[i].first}:{parts[i].last + 1}" for i, _ in task.failed)
    raise TrackerError(f"expected poses on all frames, found none on {lost}: {task.failed[0][1]}")


def _session(recording: PlannedRecording) -> Session:
    """Return the session of a recording; a row of a table gets one."""
    footage = recording.footage
    if footage is None or Path(recording.session).is_dir():
        return open_session(recording.session)
    return assemble(footage.request(recording.session))


def _tracked_before(folder: Path, key: str) -> TrackedBefore | None:
    """Return what this task found, if it was ended between tracking and its result; None if it has not tracked."""
    path = folder / ANNOTATIONS_FILE
    if not path.exists():
        return None
    with AnnotationStore(path, read_only=True) as store:
        setting: Any = store.setting(_TRACKED)
    if setting is None or setting["task"] != key:
        return None
    return msgspec.convert({k: v for k, v in setting.items() if k != "task"}, TrackedBefore)


def _with_known_bodies(session: Session, task: RecordingTask, bodies: Path) -> Session:
    """Give people the bodies that other recordings have acquired, unless they have sizes of their own."""
    known = [
        (i, bodies / f"{own_identifier(p.name)}.toml")
        for i, p in enumerate(session.people)
        if p.name in task.bodies and has_preset_proportions(p.model)
    ]
    if not any(path.is_file() for _, path in known):
        return session
    with SessionLock(session.folder), AnnotationStore(session.annotations_path) as store:
        for person, path in known:
            if path.is_file():
                label = f"body of {session.people[person].name}, acquired in another recording"
                session = store_body(session, store, person, load_model(path), {}, label)
    return session


def _share_bodies(session: Session, task: RecordingTask, bodies: Path) -> None:
    """Write the bodies that this recording acquired, for others. The first one stays."""
    for person in session.people:
        path = bodies / f"{own_identifier(person.name)}.toml"
        if person.name in task.bodies and not path.exists() and not has_preset_proportions(person.model):
            write_text_atomic(path, format_model(person.model))


def _export(session: Session, task: RecordingTask, exports: Path) -> tuple[Path, ...]:
    """Write files for other programs into a folder of the recording: those of two never have one name."""
    files, settings = list[Path](), task.recording.settings
    for name in settings.export or ():
        (exports / task.stem).mkdir(exist_ok=True)
        out = exports / task.stem / f"{task.stem}{FORMATS[name].suffixes[0]}"
        files += export(session, out, name, settings.people, overwrite=True)
    return tuple(files)


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
