"""Tracking without a page: `quadrille track`, with progress, and going on where it was stopped."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import chain
from typing import Any, get_args

import numpy as np

from app.cli.actions import Target
from app.runtime.progress import Reporter
from app.storage.tracked_changes import Keyframes, keyframes_of, told_of, tracked_changes
from tracker.compute.kernel_cache import compiled_mark
from tracker.errors import SessionError
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.session.lock import SessionLock
from tracker.session.locked_dofs import free_of, kept_locks
from tracker.session.session import Person
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.chamfer.backward_pass import Followed, Tracked, follow_back
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import track_chamfer
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate

_SAVE_FRAMES = 10
"""A tracking run is on disk at least every so many frames."""
_MOTION_FRAMES = 4
"""Frames before the first one from which its motion is known, also as it was before the last of them."""
_UNFINISHED = "unfinished track"


def track(at: Target, frames: Sequence[int], settings: TrackSettings, progress: Reporter) -> dict[str, Any]:
    """Track people with the chamfer tracker and store what is found.

    Keyframes stay as they are and tracking goes on from them; what is locked stays as it was. Whoever was lost is then
    followed back from the first trusted poses after it (`second_pass`). Interrupted, it keeps what is done, and the
    same call again goes on from there.

    Args:
        at: the session and whom to track.
        frames: in the order of tracking.
        settings: of the tracker.
        progress: shows how far it is.

    Returns:
        What was done; `stopped_at` is the next frame where it was interrupted, else None, and `followed_back` how many
        poses the second pass changed.

    Raises:
        SessionError: nobody has placed a person at or before the first frame.
    """
    session = at.session
    with (
        SessionLock(session.folder),
        closing(AnnotationStore(session.annotations_path)) as store,
        Recording(session.cameras) as recording,
    ):
        task = json.loads(json.dumps([frames[0], frames[-1], len(frames), at.people, told_of(settings)]))
        left = _left(store, task, frames)
        run = _Run(at, store, settings, frames, left)
        if not compiled_mark().exists():
            progress.say("kernels that are not compiled yet are compiled first, once: it may take a minute or two")
        stopped = False
        try:
            run.work(Observer(session.cameras, recording), progress)
        except KeyboardInterrupt:
            stopped = True
        finally:
            run.save()
            unfinished = {"task": task, "next": left[run.done] if run.done < len(left) else None}
            store.set_setting(_UNFINISHED, None if run.finished else unfinished)
    statuses, costs = run.statuses(), [c for c in run.costs.values() if np.isfinite(c)]
    return {
        "frames": run.done,
        "resumed_at": None if len(left) == len(frames) else left[0] if left else frames[-1],
        "stopped_at": None if not stopped else left[run.done] if run.done < len(left) else run.back_at,
        "followed_back": run.followed_back,
        "people": [session.people[i].name for i in at.people],
        "mean_cost_px": float(np.mean(costs)) if costs else None,
        "statuses": {session.people[i].name: dict(statuses[i]) for i in at.people},
    }


class _Run:
    """One run and what it has found so far."""

    def __init__(
        self, at: Target, store: AnnotationStore, settings: TrackSettings, frames: Sequence[int], left: Sequence[int]
    ) -> None:
        people = at.session.people
        self._at, self._store, self._settings, self._left = at, store, settings, left
        self._label = f"track frames {min(frames)}:{max(frames) + 1}"
        self._revisions = [store.add_model_revision(p.name, format_model(p.model)) for p in people]
        self._past = [_past(store, p, left or frames, i in at.people) for i, p in enumerate(people)]
        self._fixed = keyframes_of(store, people, set(frames))
        locks = kept_locks(people, store.setting)
        self._free = [free_of(p.model, locked) for p, locked in zip(people, locks, strict=True)]
        self._waiting: list[PoseChange] = []
        self._edit: int | None = None
        before = _tracked_before(at, store, frames[: len(frames) - len(left)], self._past, self._fixed)
        self._tracked = {f.frame: f for f in before}  # in the order of tracking
        self.done = 0
        self.followed_back = 0
        self.back_at = frames[-1]
        """The frame that the second pass has come to."""
        self.finished = False
        self.costs: dict[int, float] = {}
        """Of each frame, px."""

    def work(self, observer: Observer, progress: Reporter) -> None:
        """Do both passes, telling how far each is."""
        if self._left:
            with progress.over(len(self._left), "tracking") as tick:
                for found in self._estimates(observer):
                    self._take(found)
                    tick()
        self.save()
        steps = self._ways_back(observer) if self._settings.second_pass else iter(())
        if (first := next(steps, None)) is not None:
            with progress.over(first.total, "following back") as tick:
                for step in chain([first], steps):
                    self._take_back(step)
                    tick()
        self.finished = True

    def _estimates(self, observer: Observer) -> Iterator[PoseEstimate]:
        """Track the frames one by one."""
        models = [p.model for p in self._at.session.people]
        return track_chamfer(
            observer, models, self._past, self._left, self._settings, self._fixed, self._at.people, self._free
        )

    def _ways_back(self, observer: Observer) -> Iterator[Followed]:
        """Follow back whoever was lost, in this call or before it was interrupted."""
        models, found = [p.model for p in self._at.session.people], list(self._tracked.values())
        return follow_back(observer, models, found, self._settings, self._fixed, self._at.people, self._free)

    def _take(self, found: PoseEstimate) -> None:
        """Keep what was found on a frame; on disk with the next save."""
        self._keep(found, self._at.people)
        self._tracked[found.frame] = Tracked.of(found)
        self.costs[found.frame] = found.cost_px
        self.done += 1
        if len(self._waiting) >= _SAVE_FRAMES:
            self.save()

    def _take_back(self, step: Followed) -> None:
        """Keep what the second pass found better of one person, on disk at once: a whole stretch or nothing of it."""
        self.back_at = step.frame
        for found in step.better:
            self._keep(found, [step.person])
            self._tracked[found.frame] = Tracked.of(found)
            if found.frame in self.costs:  # it was tracked in this call
                self.costs[found.frame] = found.cost_px
        self.followed_back += len(step.better)
        self.save()

    def statuses(self) -> list[Counter[str]]:
        """How often each person had which status on the frames of this call."""
        of_frames = [self._tracked[k].statuses for k in self._left[: self.done]]
        return [Counter(s[i] for s in of_frames) for i in range(len(self._past))]

    def _keep(self, found: PoseEstimate, people: Sequence[int]) -> None:
        names = [p.name for p in self._at.session.people]
        self._waiting += tracked_changes([found], names, people, self._revisions, self._fixed, self._settings)

    def save(self) -> None:
        """Write what waits; all of a run is one entry of the history."""
        if self._waiting and self._edit is None:
            self._edit = self._store.commit(self._label, self._waiting, by_program=True).edit
        elif self._waiting and self._edit is not None:
            self._store.amend(self._edit, self._waiting, by_program=True)
        self._waiting.clear()


def _left(store: AnnotationStore, task: Any, frames: Sequence[int]) -> Sequence[int]:
    """The frames still to track: all, or the rest of the same task that was interrupted; none in its second pass."""
    unfinished = store.setting(_UNFINISHED)
    if unfinished is None or unfinished["task"] != task:
        return frames
    if unfinished["next"] is None:
        return frames[len(frames) :]
    return frames[list(frames).index(unfinished["next"]) :] if unfinished["next"] in frames else frames


def _tracked_before(
    at: Target, store: AnnotationStore, frames: Sequence[int], past: Sequence[Sequence[Array]], fixed: Keyframes
) -> list[Tracked]:
    """What an interrupted call has left in the store, up to the last frame that nobody has taken away since."""
    out: list[Tracked] = []
    poses = [p[-1] for p in past]
    for frame in frames:
        records = {i: store.pose(at.session.people[i].name, frame) for i in at.people}
        held = fixed.get(frame, {})
        for i in range(len(poses)):
            record = records.get(i)
            poses[i] = held[i] if i in held else poses[i] if record is None else record.values
        statuses = tuple(_status(None if i in held else records.get(i)) for i in range(len(poses)))
        gone = any(r is None and i not in held for i, r in records.items())
        if gone:
            out.clear()
        else:
            out.append(Tracked(frame, tuple(poses), statuses))
    return out


def _status(record: PoseRecord | None) -> Status:
    """How sure a pose of the store is; one that a person set, or that nobody doubted, is good."""
    statuses: tuple[Status, ...] = get_args(Status)
    return "good" if record is None else next((s for s in statuses if s == record.status), "good")


def _past(store: AnnotationStore, person: Person, frames: Sequence[int], needed: bool) -> list[Array]:
    """Poses to begin from, the last one last: those just before the first frame, else the nearest one.

    Where there is none just before, one on the first frame itself is nearest. Tracking backward, "before" is after.
    """
    first, step = frames[0], 1 if len(frames) < 2 or frames[1] > frames[0] else -1
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
        f"expected a pose of '{person.name}' at frame {first} or {where}, found none; place the body in the "
        "page, or use quadrille init"
    )
