"""Prepare a tracking run from the stored poses of a session, and resume one that was interrupted."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from tracker.errors import Remedy, SessionError
from tracker.evidence.observer import Observer
from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.smoothing import TrackedRows, resumed_rows
from tracker.pipeline.track_session import StoreSink, TrackSession
from tracker.pipeline.tracked_changes import StoredPerson, keyframes_of, recorded_method, settings_record
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Person, Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.confidence import Status, status_named
from tracker.tracking.estimate import TrackedFrame
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackerSettings, TrackingRun

_SAVE_FRAMES = 10
"""Frames after which a run is saved."""
_MOTION_FRAMES = 8
"""Frames before the first one from which its motion, and that of the frame before, is predicted."""
_RENAMED = {"second_pass": "backward_pass"}
"""Settings whose names have changed since sessions store them."""
_UNFINISHED = "unfinished track"
"""Setting of the store: the task that was interrupted and its next frame."""


class TrackTask(NamedTuple):
    """A tracking task. The same task goes on where it was interrupted."""

    frames: Sequence[int]
    """In the order of tracking."""
    people: tuple[int, ...]
    """Indices of the people to track."""
    settings: TrackerSettings
    cameras: tuple[str, ...] = ()
    """Names of the cameras to track with; all if empty."""

    def sources(self, session: Session) -> tuple[CameraSource, ...]:
        """Return the cameras to track with, in the order of the session."""
        return tuple(c for c in session.cameras if not self.cameras or c.camera.name in self.cameras)

    def record(self) -> list[Any]:
        """Return the task as the store keeps it."""
        frames, settings = self.frames, settings_record(self.settings)
        cameras = [sorted(self.cameras)] if self.cameras else []
        what = [frames[0], frames[-1], len(frames), self.people, *cameras, settings]
        found: list[Any] = json.loads(json.dumps(what))
        return found


@contextmanager
def stored_run(session: Session, store: AnnotationStore, observer: Observer, task: TrackTask) -> Iterator[TrackSession]:
    """Prepare a run that begins at stored poses. At the end it is saved, and its rest noted if it is not finished.

    Keyframes and locked degrees of freedom stay as they are.

    Args:
        session: whose people are tracked.
        store: annotations of the session.
        observer: of the session.
        task: what to track.

    Raises:
        SessionError: a person has no pose at or before the first frame.
    """
    people, frames = session.people, task.frames
    left = _frames_left(store, task)
    start = [_start_poses(store, p, left or frames, i in task.people) for i, p in enumerate(people)]
    locks = load_locks(people, store.setting)
    active = [active_dofs(p.model, locked) for p, locked in zip(people, locks, strict=True)]
    subjects = Subjects.of(
        [p.model for p in people], task.people, active, keyframes_of(store, people, frozenset(frames))
    )
    before = frames[: len(frames) - len(left)]
    run = TrackSession(
        make_tracker(task.settings),
        TrackingRun(observer, subjects, start, left, session.fps, floor_plane(session.up, session.floor)),
        [StoredPerson(p.name, store.add_model_revision(p.name, format_model(p.model))) for p in people],
        StoreSink(store, _views(session, task)),
        f"track frames {min(frames)}:{max(frames) + 1}",
        _SAVE_FRAMES,
        _tracked_before(session, store, before, start, subjects),
        _rows_before(session, store, before, subjects),
    )
    try:
        yield run
    finally:
        run.save()
        unfinished = None
        if not run.finished:
            unfinished = {"task": task.record(), "next": run.next_frame, "rows": run.rows_record()}
        store.set_setting(_UNFINISHED, unfinished)


def _views(session: Session, task: TrackTask) -> list[int | None]:
    """Return for each camera of the session its index among those that are tracked with; None for the others."""
    used = [c.camera.name for c in task.sources(session)]
    return [used.index(c.camera.name) if c.camera.name in used else None for c in session.cameras]


def _frames_left(store: AnnotationStore, task: TrackTask) -> Sequence[int]:
    """Return the frames still to track: all, or the rest of an interrupted run; none in its backward pass."""
    unfinished, frames = store.setting(_UNFINISHED), task.frames
    if unfinished is None or not _same_task(unfinished["task"], task.record()):
        return frames
    if unfinished["next"] is None:
        return frames[len(frames) :]
    return frames[list(frames).index(unfinished["next"]) :] if unfinished["next"] in frames else frames


def _same_task(stored: list[Any], task: list[Any]) -> bool:
    """Return whether two records are of the same task, also one that an older version stored."""
    *what, settings = stored
    renamed = {_RENAMED.get(name, name): value for name, value in settings.items()}
    return [*what, {**renamed, "method": recorded_method(settings)}] == task


def _tracked_before(
    session: Session, store: AnnotationStore, frames: Sequence[int], start: Sequence[Sequence[Array]],
    subjects: Subjects,
) -> list[TrackedFrame]:  # fmt: skip
    """Return the stored frames of an interrupted run, from the one after the last that has been cleared since."""
    out: list[TrackedFrame] = []
    poses = [p[-1] for p in start]
    for frame in frames:
        records = {i: store.pose(session.people[i].name, frame) for i in subjects.tracked}
        keyframes = subjects.keyframes_at(frame)
        for i in range(len(poses)):
            record = records.get(i)
            poses[i] = keyframes[i] if i in keyframes else poses[i] if record is None else record.values
        statuses = tuple(_status(None if i in keyframes else records.get(i)) for i in range(len(poses)))
        if any(r is None and i not in keyframes for i, r in records.items()):
            out.clear()
        else:
            out.append(TrackedFrame(frame, tuple(poses), statuses))
    return out


def _rows_before(
    session: Session, store: AnnotationStore, frames: Sequence[int], subjects: Subjects
) -> dict[int, TrackedRows]:
    """Return the rows of an interrupted run by person."""
    unfinished = store.setting(_UNFINISHED)
    if not frames or unfinished is None:
        return {}
    rows = {}
    for i in subjects.tracked:
        name = session.people[i].name
        records = ((f, store.pose(name, f)) for f in frames)
        rows[i] = tuple(PoseChange(name, f, r, tuple(store.alternatives(name, f))) for f, r in records if r is not None)
    return resumed_rows(rows, unfinished.get("rows", {}))


def _status(record: PoseRecord | None) -> Status:
    """Return the status of a stored pose; "good" for a keyframe and for a pose without a status."""
    return "good" if record is None else status_named(record.status)


def _start_poses(store: AnnotationStore, person: Person, frames: Sequence[int], needed: bool) -> list[Array]:
    """Return the poses to begin from, the last one last: those just before the first frame, else the nearest one.

    Without any just before, a pose on the first frame itself is nearest. Tracking backward, "before" is after.

    Args:
        store: annotations of the session.
        person: whose poses.
        frames: to track, in order.
        needed: whether the person is tracked; others may have the neutral pose.

    Raises:
        SessionError: a pose is needed and there is none.
    """
    first, step = frames[0], 1 if len(frames) < 2 else frames[1] - frames[0]
    rows = {row.frame for row in store.frames(person.name)}

    def pose(frame: int) -> Array | None:
        record = store.pose(person.name, frame) if frame in rows else None
        return None if record is None or len(record.values) != len(person.model.value_names) else record.values

    past: list[Array] = []
    for frame in range(first - _MOTION_FRAMES * step, first, step):
        found = pose(frame)
        past = [] if found is None else [*past, found]
    if past:
        return past
    near = [f for f in (first, *sorted(rows, key=lambda f: abs(f - first))) if f == first or (first - f) * step > 0]
    found = next((p for p in map(pose, near) if p is not None), None)
    if found is not None:
        return [found]
    if not needed:
        return [person.model.neutral()]
    where = "before" if step > 0 else "after"
    raise SessionError(
        f"expected a pose of '{person.name}' at frame {first} or {where}, found none", Remedy("place_body")
    )
