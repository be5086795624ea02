"""Tracking without a page: `quadrille track`, with progress, and going on where it was stopped."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from app.commands import Reporter, Target
from app.compiling import compiled_mark
from app.tracked import keyframes_of, told_of, tracked_changes
from tracker.annotations import AnnotationStore
from tracker.errors import SessionError
from tracker.evidence import Observer
from tracker.formats.model_toml import format_model
from tracker.locks import free_of, kept_locks
from tracker.recording import Recording
from tracker.records import PoseChange
from tracker.rigid import Array
from tracker.session import Person
from tracker.session_lock import SessionLock
from tracker.track import PoseEstimate, track_chamfer
from tracker.track_settings import TrackSettings

_SAVE_FRAMES = 10
"""A tracking run is on disk at least every so many frames."""
_MOTION_FRAMES = 3
"""Frames before the first one from which its motion is known."""
_UNFINISHED = "unfinished track"


def track(at: Target, frames: Sequence[int], settings: TrackSettings, progress: Reporter) -> dict[str, Any]:
    """Track people with the chamfer tracker and store what is found.

    Keyframes stay as they are and tracking goes on from them; what is locked stays as it was. Interrupted, it keeps
    what is done, and the same call again goes on from there.

    Args:
        at: the session and whom to track.
        frames: in the order of tracking.
        settings: of the tracker.
        progress: shows how far it is.

    Returns:
        What was done; `stopped_at` is the next frame where it was interrupted, else None.

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
        run = _Run(at, store, settings, left, f"track frames {min(frames)}:{max(frames) + 1}")
        if not compiled_mark().exists():
            progress.say("kernels that are not compiled yet are compiled first, once: it may take a minute or two")
        try:
            with progress.over(len(left), "tracking") as tick:
                for found in run.estimates(Observer(session.cameras, recording)):
                    run.take(found)
                    tick()
            stopped_at = None
        except KeyboardInterrupt:
            stopped_at = left[run.done]
        finally:
            run.save()
            unfinished = run.done < len(left)
            store.set_setting(_UNFINISHED, {"task": task, "next": left[run.done]} if unfinished else None)
    return {
        "frames": run.done,
        "resumed_at": left[0] if len(left) < len(frames) else None,
        "stopped_at": stopped_at,
        "people": [session.people[i].name for i in at.people],
        "mean_cost_px": float(np.mean(run.costs)) if run.costs else None,
        "statuses": {session.people[i].name: dict(run.statuses[i]) for i in at.people},
    }


class _Run:
    """One run and what it has found so far."""

    def __init__(
        self, at: Target, store: AnnotationStore, settings: TrackSettings, frames: Sequence[int], label: str
    ) -> None:
        people = at.session.people
        self._at, self._store, self._settings, self._frames, self._label = at, store, settings, frames, label
        self._revisions = [store.add_model_revision(p.name, format_model(p.model)) for p in people]
        self._past = [_past(store, p, frames, i in at.people) for i, p in enumerate(people)]
        self._fixed = keyframes_of(store, people, set(frames))
        locks = kept_locks(people, store.setting)
        self._free = [free_of(p.model, locked) for p, locked in zip(people, locks, strict=True)]
        self._waiting: list[PoseChange] = []
        self._edit: int | None = None
        self.done = 0
        self.costs: list[float] = []
        self.statuses: list[Counter[str]] = [Counter() for _ in people]

    def estimates(self, observer: Observer) -> Iterator[PoseEstimate]:
        """Track the frames one by one."""
        models = [p.model for p in self._at.session.people]
        return track_chamfer(
            observer, models, self._past, self._frames, self._settings, self._fixed, self._at.people, self._free
        )

    def take(self, found: PoseEstimate) -> None:
        """Keep what was found on a frame; on disk with the next save."""
        names = [p.name for p in self._at.session.people]
        self._waiting += tracked_changes([found], names, self._at.people, self._revisions, self._fixed, self._settings)
        self.done += 1
        if np.isfinite(found.cost_px):
            self.costs.append(found.cost_px)
        for i, status in enumerate(found.statuses):
            self.statuses[i][status] += 1
        if len(self._waiting) >= _SAVE_FRAMES:
            self.save()

    def save(self) -> None:
        """Write what waits; all of a run is one entry of the history."""
        if self._waiting and self._edit is None:
            self._edit = self._store.commit(self._label, self._waiting, by_program=True).edit
        elif self._waiting and self._edit is not None:
            self._store.amend(self._edit, self._waiting, by_program=True)
        self._waiting.clear()


def _left(store: AnnotationStore, task: Any, frames: Sequence[int]) -> Sequence[int]:
    """The frames still to do: all, or the rest of the same task that was interrupted."""
    unfinished = store.setting(_UNFINISHED)
    if unfinished is None or unfinished["task"] != task or unfinished["next"] not in frames:
        return frames
    return frames[list(frames).index(unfinished["next"]) :]


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
