"""Do a task: make the session if there is none, give it the bodies that are known, track it, write its files."""

import hashlib
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from tracker.api.results import export
from tracker.api.sessions import frames_of, new_session, open_session
from tracker.api.work import Progress, Tracked, track
from tracker.batch.manifest import RecordingTask
from tracker.batch.plan import PlannedRecording, plain
from tracker.errors import TrackerError
from tracker.exports.formats import FORMATS
from tracker.files import write_text_atomic
from tracker.formats.file_names import identifier
from tracker.formats.model_toml import format_model, has_preset_proportions, load_model
from tracker.pipeline.body_acquisition import store_body
from tracker.session.frame_list import parse_frame_list
from tracker.session.lock import SessionLock
from tracker.session.session import Session, load_session
from tracker.store.annotation_store import AnnotationStore

_TRACKED = "batch"
"""Setting of the session: the task that tracked it, and what it found. The same task does not track again."""


class Done(NamedTuple):
    """The results of a task."""

    tracked: Tracked
    files: tuple[Path, ...]
    """Exported files."""


def do_task(task: RecordingTask, folder: Path, progress: Progress) -> Done:
    """Track a recording as its settings say. A task that was interrupted goes on where it was.

    Args:
        task: to do; the caller has claimed it.
        folder: of the batch.
        progress: receives the progress. An exception that it raises ends the work.

    Raises:
        TrackerError: the recording cannot be tracked or exported.
    """
    recording, settings = task.recording, task.recording.settings
    session = _session(recording)
    key = hashlib.sha256(msgspec.json.encode(plain(recording))).hexdigest()
    tracked = _tracked_before(session, key)
    if tracked is None:
        session = _with_known_bodies(session, task, folder / "bodies")
        frames = frames_of(session, _frames(recording, session.n_frames))
        tracked = track(
            session,
            settings.people,
            frames[:: settings.stride or 1],
            method=settings.method or "chamfer",
            options=settings.options,
            find_missing=settings.find is not False,
            acquire_sizes=settings.acquire is not False,
            keypoints=settings.keypoints,
            progress=progress,
        )
        with SessionLock(session.folder), closing(AnnotationStore(session.annotations_path)) as store:
            store.set_setting(_TRACKED, {"task": key, "tracked": asdict(tracked)})
    _share_bodies(load_session(session.folder), task, folder / "bodies")
    return Done(tracked, _export(session, recording, folder / "exports"))


def _session(recording: PlannedRecording) -> Session:
    """Return the session of a recording; a row of a table gets one."""
    footage = recording.footage
    if footage is None or Path(recording.session).is_dir():
        return open_session(recording.session)
    return new_session(
        recording.session,
        footage.videos,
        footage.calibration,
        footage.people,
        background=footage.background,
        heights=footage.height_m,
        fps=footage.fps,
    )


def _frames(recording: PlannedRecording, n_frames: int) -> list[int] | None:
    text = recording.settings.frames
    return None if text is None else list(parse_frame_list(text, n_frames, f"frames of {recording.name}"))


def _tracked_before(session: Session, key: str) -> Tracked | None:
    """Return what this task found, if it was ended between tracking and its result; None if it has not tracked."""
    if not session.annotations_path.exists():
        return None
    with closing(AnnotationStore(session.annotations_path, read_only=True)) as store:
        found: Any = store.setting(_TRACKED)
    return Tracked(**found["tracked"]) if found is not None and found["task"] == key else None


def _with_known_bodies(session: Session, task: RecordingTask, bodies: Path) -> Session:
    """Give people the bodies that other recordings have acquired, unless they have sizes of their own."""
    known = [
        (i, bodies / f"{identifier(p.name)}.toml")
        for i, p in enumerate(session.people)
        if p.name in task.bodies and has_preset_proportions(p.model)
    ]
    if not any(path.is_file() for _, path in known):
        return session
    with SessionLock(session.folder), closing(AnnotationStore(session.annotations_path)) as store:
        for person, path in known:
            if path.is_file():
                label = f"body of {session.people[person].name}, acquired in another recording"
                session = store_body(session, store, person, load_model(path), {}, label)
    return session


def _share_bodies(session: Session, task: RecordingTask, bodies: Path) -> None:
    """Write the bodies that this recording acquired, for others. The first one stays."""
    for person in session.people:
        path = bodies / f"{identifier(person.name)}.toml"
        if person.name in task.bodies and not path.exists() and not has_preset_proportions(person.model):
            write_text_atomic(path, format_model(person.model))


def _export(session: Session, recording: PlannedRecording, exports: Path) -> tuple[Path, ...]:
    files = list[Path]()
    for name in recording.settings.export or ():
        if name not in FORMATS:
            raise TrackerError(f"expected formats among {', '.join(FORMATS)}, found '{name}'; correct the plan")
        out = exports / f"{identifier(recording.name.replace('/', '_'))}{FORMATS[name].suffixes[0]}"
        files += export(session, out, name, recording.settings.people, overwrite=True)
    return tuple(files)
