"""Prepare a tracking run from the stored poses of a session, and resume one that was interrupted."""

import itertools
import json
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tracker.body.motion.history import HISTORY_FRAMES
from tracker.errors import Remedy, SessionError
from tracker.estimation.runs.run_estimate import poses_beside
from tracker.estimation.tracking.confidence import Status, status_named
from tracker.estimation.tracking.tracker import Subjects, TrackedFrame, TrackerSettings, TrackingRun
from tracker.estimation.trajectory.solve import even_blocks
from tracker.evidence.observer import Observer
from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.pipeline.keypoint_evidence import read_points, stored_seen_bodies, with_keypoints
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Leg, TrackSession, outward
from tracker.pipeline.tracked_changes import StoredPerson, StoreWriter, keyframes_of, recorded_method, settings_record
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Person, Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseRecord

_SAVE_FRAMES = 10
"""Frames after which a run is saved."""
UNFINISHED = "unfinished track"
"""Setting of the store: the plan that was interrupted and its next frame."""


@dataclass(frozen=True)
class TrackPlan:
    """A run to track: frames, people, settings and cameras. The same plan goes on where it was interrupted."""

    frames: Sequence[int]
    """In the order of tracking; ascending for a run that goes out from a start."""
    people: tuple[int, ...]
    """Indices of the people to track."""
    settings: TrackerSettings
    """Of the tracker; they name its method."""
    cameras: tuple[str, ...] = ()
    """Names of the cameras to track with; all if empty."""
    start: int | None = None
    """Frame from which the run goes out in both directions; None for a run from the first frame to the last."""
    keypoints: str | None = None
    """Name of the observations whose key points are evidence, too; None for contours alone."""

    @property
    def legs(self) -> list[Sequence[int]]:
        """Frames of each leg in the order of tracking. A leg ends before a gap in the frames."""
        if self.start is not None:
            return outward(self.frames, self.start)
        steps = np.diff(self.frames)
        ends = [0, *(int(i) + 1 for i in np.flatnonzero(steps != steps[:1])), len(self.frames)]
        return [self.frames[a:b] for a, b in pairwise(ends)]

    def sources(self, session: Session) -> tuple[CameraSource, ...]:
        """Return the cameras to track with, in the order of the session."""
        return tuple(c for c in session.cameras if not self.cameras or c.camera.name in self.cameras)

    def record(self) -> list[Any]:
        """Return the plan as the store keeps it."""
        frames, settings = self.frames, settings_record(self.settings)
        cameras = [sorted(self.cameras)] if self.cameras else []
        named = {"start": self.start, "keypoints": self.keypoints}
        chosen = {k: v for k, v in named.items() if v is not None}
        start = [chosen] if chosen else []
        what = [frames[0], frames[-1], len(frames), self.people, *cameras, *start, settings]
        as_stored: list[Any] = json.loads(json.dumps(what))
        return as_stored


@contextmanager
def stored_run(
    session: Session, store: AnnotationStore, observer: Observer, plan: TrackPlan
) -> Generator[TrackSession, None, None]:
    """Prepare a run that begins at stored poses. At the end it is saved, and its rest noted if it is not finished.

    Keyframes and locked degrees of freedom stay as they are. People who are not tracked keep their stored poses.

    Args:
        session: whose people are tracked.
        store: annotations of the session.
        observer: of the session.
        plan: what to track.

    Raises:
        SessionError: a person has no pose at or before the first frame.
    """
    people = session.people
    if plan.keypoints is not None:
        seen = stored_seen_bodies(session, store, plan.keypoints)
        observer = with_keypoints(session, observer, read_points(session, plan.keypoints), seen)
    locks = load_locks(people, store.setting)
    active = [active_dofs(p.model, locked) for p, locked in zip(people, locks, strict=True)]
    others = [i for i in range(len(people)) if i not in plan.people]
    keyframes = keyframes_of(store, people, frozenset(plan.frames), others)
    subjects = Subjects.of([p.model for p in people], plan.people, active, keyframes)
    floor, legs, done = floor_plane(session.up, session.floor), list[Leg](), list[int]()
    for frames, n_done in zip(plan.legs, _frames_done(session, store, plan), strict=True):
        start = _start_poses(session, store, frames, plan)
        known = frames[:n_done] or ([] if plan.start is None else [plan.start])
        legs.append(
            Leg(
                TrackingRun(observer, subjects, start, frames, session.fps, floor),
                _tracked_before(session, store, known, start, subjects, plan.start),
                plan.start,
                _stored_starts(session, store, plan),
                {} if plan.start is not None else _history(session, store, frames),
            )
        )
        done += [k for k in frames[:n_done] if k != plan.start]
    run = TrackSession(
        make_tracker(plan.settings),
        legs,
        [StoredPerson(p.name, store.add_model_revision(p.name, format_model(p.model))) for p in people],
        StoreWriter(store),
        f"track frames {min(plan.frames)}:{max(plan.frames) + 1}",
        _SAVE_FRAMES,
        _records_before(session, store, done, subjects),
    )
    try:
        yield run
    finally:
        run.save()
        unfinished = None
        if not run.finished:
            unfinished = {"task": plan.record(), "next": run.next_frame}
        store.set_setting(UNFINISHED, unfinished)


def _history(session: Session, store: AnnotationStore, frames: Sequence[int]) -> dict[int, list[Array]]:
    """Return the stored poses of all people on the two frames before some frames, as far as all have one."""
    step = frames[1] - frames[0] if len(frames) > 1 else 1
    return poses_beside(frames[0], -step, lambda k: [_pose_on(store, person, k) for person in session.people])


def _frames_done(session: Session, store: AnnotationStore, plan: TrackPlan) -> list[int]:
    """Return how many frames of each leg an interrupted run has stored, in whole blocks; the others are tracked."""
    out = [0] * len(plan.legs)
    if not is_interrupted(store, plan):
        return out
    following = store.setting(UNFINISHED)["next"]
    rows = [store.frames(session.people[i].name) for i in plan.people]
    posed = set.intersection(*({row.frame for row in of_person} for of_person in rows))
    for number, leg in enumerate(plan.legs):
        n_stored = len([*itertools.takewhile(lambda k: k != following and k in posed, leg)])
        out[number] = max([0, *(own.stop for own, _ in even_blocks(len(leg)) if own.stop <= n_stored)])
        if following in leg and following != plan.start:
            break
    return out


def forget_unfinished(store: AnnotationStore) -> None:
    """Forget an interrupted run, so that the same plan starts from its beginning."""
    store.set_setting(UNFINISHED, None)


def is_interrupted(store: AnnotationStore, plan: TrackPlan) -> bool:
    """Return whether a run of this plan was interrupted, so that it goes on there."""
    unfinished = store.setting(UNFINISHED)
    return unfinished is not None and _same_task(unfinished["task"], plan.record())


def _same_task(stored: list[Any], task: list[Any]) -> bool:
    """Return whether two records are of the same task, also one that an older version stored."""
    *what, settings = stored
    return [*what, {**settings, "method": recorded_method(settings)}] == task


def _tracked_before(
    session: Session, store: AnnotationStore, frames: Sequence[int], start: Sequence[Sequence[Array]],
    subjects: Subjects, held: int | None,
) -> list[TrackedFrame]:  # fmt: skip
    """Return stored frames. The pose of the frame `held`, which the run goes out from, is trusted."""
    out: list[TrackedFrame] = []
    poses = [p[-1] for p in start]
    for frame in frames:
        records = {i: store.pose(session.people[i].name, frame) for i in subjects.tracked}
        keyframes = subjects.keyframes_at(frame)
        for i in range(len(poses)):
            record = records.get(i)
            poses[i] = keyframes[i] if i in keyframes else poses[i] if record is None else record.values
        is_trusted = [i in keyframes or frame == held for i in range(len(poses))]
        statuses = tuple(_status(None if trusted else records.get(i)) for i, trusted in enumerate(is_trusted))
        others = tuple(_others(store, session, i, frame) if i in records else () for i in range(len(poses)))
        out.append(TrackedFrame(frame, tuple(poses), statuses, others))
    return out


def _others(store: AnnotationStore, session: Session, person: int, frame: int) -> tuple[Array, ...]:
    """Return the stored alternatives of a pose, (n_values,) each."""
    n_values = len(session.people[person].model.value_names)
    alternatives = store.alternatives(session.people[person].name, frame)
    return tuple(other.values for other in alternatives if len(other.values) == n_values)


def _stored_starts(session: Session, store: AnnotationStore, plan: TrackPlan) -> dict[int, PoseRecord]:
    """Return the stored poses of the frame that a run goes out from, by index of the person."""
    if plan.start is None:
        return {}
    starts = {i: store.pose(session.people[i].name, plan.start) for i in plan.people}
    return {i: record for i, record in starts.items() if record is not None}


def _records_before(
    session: Session, store: AnnotationStore, frames: Sequence[int], subjects: Subjects
) -> dict[tuple[int, int], PoseRecord]:
    """Return the poses that an interrupted run has stored, by person and frame."""
    stored_poses = {(i, k): store.pose(session.people[i].name, k) for i in subjects.tracked for k in frames}
    return {at: record for at, record in stored_poses.items() if record is not None}


def _status(record: PoseRecord | None) -> Status:
    """Return the status of a stored pose; "good" for a keyframe and for a pose without a status."""
    return "good" if record is None else status_named(record.status)


def _start_poses(session: Session, store: AnnotationStore, frames: Sequence[int], plan: TrackPlan) -> list[list[Array]]:
    """Return the poses from which each person is tracked: those before the first frame, or that of the start alone."""
    out, step = [], frames[1] - frames[0] if len(frames) > 1 else 1
    for i, person in enumerate(session.people):
        known = None if plan.start is None else _pose_on(store, person, plan.start)
        out.append(_poses_before(store, person, frames[0], step, i in plan.people) if known is None else [known])
    return out


def _pose_on(store: AnnotationStore, person: Person, frame: int) -> Array | None:
    """Return the stored pose of a frame; None if there is none of the present degrees of freedom."""
    record = store.pose(person.name, frame)
    return None if record is None or len(record.values) != len(person.model.value_names) else record.values


def _poses_before(store: AnnotationStore, person: Person, first: int, step: int, needed: bool) -> list[Array]:
    """Return the poses to begin from, the last one last: those just before the first frame, else the nearest one.

    Without any just before, a pose on the first frame itself is nearest. Tracking backward, "before" is after.

    Args:
        store: annotations of the session.
        person: whose poses.
        first: frame to track first.
        step: from each frame to the next one; negative for tracking backward.
        needed: whether the person is tracked; others may have the neutral pose.

    Raises:
        SessionError: a pose is needed and there is none.
    """
    rows = {row.frame for row in store.frames(person.name)}

    def pose(frame: int) -> Array | None:
        return _pose_on(store, person, frame) if frame in rows else None

    past: list[Array] = []
    for frame in range(first - HISTORY_FRAMES * step, first, step):
        nearest = pose(frame)
        past = [] if nearest is None else [*past, nearest]
    if past:
        return past
    near = [f for f in (first, *sorted(rows, key=lambda f: abs(f - first))) if f == first or (first - f) * step > 0]
    nearest = next((p for p in map(pose, near) if p is not None), None)
    if nearest is not None:
        return [nearest]
    if not needed:
        return [person.model.neutral()]
    where = "before" if step > 0 else "after"
    raise SessionError(
        f"expected a pose of '{person.name}' at frame {first} or {where}, found none", Remedy("place_body")
    )
