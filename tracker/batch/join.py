"""Join the stretches of a long recording, in the store of its session, by one worker.

Neighbouring stretches share some frames. They are joined at the frame on which their tracks agree best. The distance of
the tracks there is the seam. On all shared frames the expected errors count what the tracks disagree about, by the rule
of poses between keyframes (`tracker.pipeline.keyframe_stretches`), so that a seam over the tolerance is doubted.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from tracker.api.work import Progress, Tracked
from tracker.batch.stretch_work import FOUND
from tracker.batch.stretches import Division, RecordingStretch, SeamRow
from tracker.errors import SessionError
from tracker.geometry.arrays import Array
from tracker.pipeline.keyframe_stretches import Seam, seam_of, with_seam
from tracker.session.lock import SessionLock
from tracker.session.session import Person, Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import AssessmentChange, PoseChange, PoseRecord

_JOINING = "joining"
"""Setting of the session: the task that joins stretches, and the entry of the history to which it adds poses."""


class TrackedStretch(NamedTuple):
    """A stretch that was tracked."""

    stretch: RecordingStretch
    folder: Path
    """Of its copy of the session."""
    tracked: Tracked


class Joined(NamedTuple):
    """The result of a recording that was joined."""

    tracked: Tracked
    seams: tuple[SeamRow, ...]


class _Cut(NamedTuple):
    """The frame at which two stretches are joined."""

    frame: int
    """First frame of the later stretch."""
    seams: Mapping[int, Mapping[int, Seam]]
    """By index of the person and shared frame."""
    rows: tuple[SeamRow, ...]


def join(
    session: Session, division: Division, parts: Sequence[TrackedStretch], task: str, progress: Progress
) -> Joined | Division:
    """Join the stretches of a recording, or find that people bear each other's names in some of them.

    Args:
        session: of the recording.
        division: of the recording.
        parts: the stretches that were tracked, in the order of time; others failed.
        task: identifies what is done; a join of the same task that was interrupted goes on in its entry of the history.
        progress: receives the progress.

    Returns:
        The result; or the division with the right names, whose changed stretches are to be tracked once more.

    Raises:
        TrackerError: another program has the session open.
    """
    with ExitStack() as stack:
        stores = {
            part.stretch.number: stack.enter_context(
                AnnotationStore(part.folder / session.annotations_path.name, read_only=True)
            )
            for part in parts
        }
        people = [session.people[i] for i in division.people]
        joiner = _Joiner(people, division, parts, stores)
        if (named := joiner.with_names()) != division:
            return named
        cuts = {b.stretch.number: joiner.cut(a, b) for a, b in pairwise(parts) if _are_neighbours(a, b)}
        stack.enter_context(SessionLock(session.folder))
        store = stack.enter_context(AnnotationStore(session.annotations_path))
        writer = _Writer(store, task, f"track frames {division.frames[0]}:{division.range[-1] + 1}")
        statuses = {person.name: Counter[str]() for person in people}
        for n, part in enumerate(parts):
            progress("joining stretches", n / len(parts))
            for person in people:
                changes = joiner.changes(part, person, cuts, writer)
                statuses[person.name].update(c.pose.status for c in changes if isinstance(c, PoseChange) and c.pose)
                writer.write(changes)
    return Joined(_tracked(division, parts, statuses), tuple(row for cut in cuts.values() for row in cut.rows))


def _are_neighbours(a: TrackedStretch, b: TrackedStretch) -> bool:
    return b.stretch.number == a.stretch.number + 1


def _tracked(division: Division, parts: Sequence[TrackedStretch], statuses: Mapping[str, Mapping[str, int]]) -> Tracked:
    weights = [part.tracked.frames for part in parts if np.isfinite(part.tracked.mean_cost_px)]
    costs = [part.tracked.mean_cost_px for part in parts if np.isfinite(part.tracked.mean_cost_px)]
    n_frames = sum(max(statuses.values(), key=lambda own: sum(own.values())).values())
    return Tracked(
        n_frames,
        {name: dict(own) for name, own in statuses.items()},
        float(np.average(costs, weights=weights)) if sum(weights) else float("nan"),
        division.start,
        next((part.tracked.contradiction for part in parts if part.tracked.contradiction), ""),
    )


class _Joiner:
    """The tracks of all stretches."""

    def __init__(
        self,
        people: Sequence[Person],
        division: Division,
        parts: Sequence[TrackedStretch],
        stores: Mapping[int, AnnotationStore],
    ) -> None:
        self._people, self._division, self._parts, self._stores = people, division, parts, stores

    def with_names(self) -> Division:
        """Return the division with the names of people by their places, on from the stretch with their first poses.

        A stretch whose names are sure, or were changed once, stays: its seam shows an error.
        """
        if len(self._people) < 2:
            return self._division
        numbers = [part.stretch.number for part in self._parts]
        anchor = next((i for i, p in enumerate(self._parts) if p.stretch.last >= self._division.start), 0)
        changed = {}
        for order in (range(anchor + 1, len(numbers)), range(anchor - 1, -1, -1)):
            before, names = anchor, tuple(range(len(self._people)))
            for i in order:
                a, b = self._parts[before], self._parts[i]
                is_sure = not self._stores[numbers[i]].setting(FOUND, False) or bool(b.stretch.names)
                if is_sure or abs(numbers[i] - numbers[before]) > 1:
                    names = tuple(range(len(self._people)))
                else:
                    names = tuple(names[j] for j in self._same_places(a, b))
                if names != tuple(sorted(names)):
                    changed[numbers[i]] = msgspec.structs.replace(b.stretch, names=names)
                before = i
        stretches = tuple(changed.get(s.number, s) for s in self._division.stretches)
        return msgspec.structs.replace(self._division, stretches=stretches)

    def _same_places(self, a: TrackedStretch, b: TrackedStretch) -> Sequence[int]:
        """Return for each person of one stretch the position of the person of another who is in their place."""
        from scipy.optimize import linear_sum_assignment  # imported lazily: loading takes 0.1 s

        first, second = sorted((a, b), key=lambda part: part.stretch.number)
        shared = self._shared(first, second)

        def places(part: TrackedStretch, person: Person) -> Array:
            poses = self._poses(part, person, shared)
            nowhere = np.full((1, 3), np.nan)
            points = [person.model.points_world(poses[k].values) if k in poses else nowhere for k in shared]
            return np.array([of_frame.mean(axis=0) for of_frame in points])

        of_a, of_b = ([places(part, person) for person in self._people] for part in (a, b))
        apart_m = np.array([[np.nanmean(np.linalg.norm(p - q, axis=1)) for q in of_a] for p in of_b])
        return [int(j) for j in linear_sum_assignment(apart_m)[1]]

    def cut(self, a: TrackedStretch, b: TrackedStretch) -> _Cut:
        """Return the frame at which two neighbours agree best, of all people together, and their seams.

        Keyframes have no seam.
        """
        shared = self._shared(a, b)
        seams = {i: self._seams(a, b, person, shared) for i, person in enumerate(self._people)}
        apart_mm = {
            k: [seams[i][k].seam_mm(person.model) for i, person in enumerate(self._people) if k in seams[i]]
            for k in shared
        }
        frame = min(shared, key=lambda k: (max(apart_mm[k], default=0.0), k))
        rows = (
            SeamRow(frame, person.name, round(seams[i][frame].seam_mm(person.model), 1))
            for i, person in enumerate(self._people)
            if frame in seams[i]
        )
        return _Cut(frame, seams, tuple(rows))

    def changes(
        self, part: TrackedStretch, person: Person, cuts: Mapping[int, _Cut], writer: "_Writer"
    ) -> list[PoseChange | AssessmentChange]:
        """Return the poses of a person in a stretch as the session is to have them, from its cut to the next one.

        Args:
            part: the stretch.
            person: one of its people.
            cuts: by number of the stretch that begins there; none beside a stretch that failed.
            writer: knows the bodies of the session.
        """
        stretch, step = part.stretch, self._division.range.step
        start, end = cuts.get(stretch.number), cuts.get(stretch.number + 1)
        frames = range(
            stretch.first if start is None else start.frame, stretch.last + 1 if end is None else end.frame, step
        )
        number, store = self._people.index(person), self._stores[stretch.number]
        seams = {k: s for cut in (start, end) if cut is not None for k, s in cut.seams.get(number, {}).items()}
        bodies = {r.id: writer.revision(person.name, r.toml) for r in store.model_revisions(person.name)}
        out = list[PoseChange | AssessmentChange]()
        for frame, pose in self._poses(part, person, frames).items():
            if pose.keyframe:
                out.append(AssessmentChange.of(person.name, frame, pose))
                continue
            pose = replace(pose, model_revision=bodies[pose.model_revision])
            if frame in seams:
                pose = with_seam(person.model, pose, seams[frame])
            others = tuple(
                replace(a, model_revision=bodies[a.model_revision]) for a in store.alternatives(person.name, frame)
            )
            out.append(PoseChange(person.name, frame, pose, others))
        return out

    def _seams(self, a: TrackedStretch, b: TrackedStretch, person: Person, shared: range) -> dict[int, Seam]:
        """Return how far two tracks of a person lie apart, by frame; keyframes are left out."""
        poses, others = self._poses(a, person, shared), self._poses(b, person, shared)
        between, starts = list[int](), list[Array]()
        for part in (a, b):
            frame = part.tracked.first_frame
            assert frame is not None
            pose = self._stores[part.stretch.number].pose(person.name, frame)
            between.append(frame)
            starts += [] if pose is None else [pose.values]
        return {
            k: seam_of(person.model, poses[k].values, others[k].values, (between[0], between[1]), starts)
            for k in shared
            if k in poses and k in others and not poses[k].keyframe
        }

    def _shared(self, a: TrackedStretch, b: TrackedStretch) -> range:
        return range(b.stretch.first, a.stretch.last + 1, self._division.range.step)

    def _poses(self, part: TrackedStretch, person: Person, frames: range) -> dict[int, PoseRecord]:
        poses = self._stores[part.stretch.number].poses(person.name, range(frames[0], frames[-1] + 1)) if frames else {}
        return {k: pose for k, pose in poses.items() if k in frames}


class _Writer:
    """Adds poses to one entry of the history of a session."""

    def __init__(self, store: AnnotationStore, task: str, label: str) -> None:
        self._store, self._task, self._label = store, task, label
        self._revisions = dict[tuple[str, str], int]()
        before: Any = store.setting(_JOINING)
        self._edit: int | None = before["edit"] if before is not None and before["task"] == task else None

    def revision(self, person: str, toml: str) -> int:
        """Return the number that a body has in the session."""
        if (person, toml) not in self._revisions:
            self._revisions[person, toml] = self._store.add_model_revision(person, toml)
        return self._revisions[person, toml]

    def write(self, changes: Sequence[PoseChange | AssessmentChange]) -> None:
        """Write poses, but leave keyframes as they are."""
        if not changes:
            return
        if self._edit is not None:
            try:
                self._store.amend(self._edit, changes, by_program=True)
                return
            except SessionError:  # a person has changed something since a worker died: begin an entry after that
                self._edit = None
        made = self._store.commit(
            self._label, changes, by_program=True, settings=lambda e: {_JOINING: {"task": self._task, "edit": e}}
        )
        self._edit = made.edit
