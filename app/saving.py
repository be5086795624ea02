"""Poses of the screen to the store and back."""

from bisect import bisect_left, insort
from collections.abc import Sequence

import numpy as np

from app.state import Shown, State
from tracker.annotations import AnnotationStore
from tracker.errors import TrackerError
from tracker.formats.model_toml import format_model
from tracker.records import HistoryEntry, PoseChange, PoseRecord
from tracker.rigid import Array
from tracker.session import Session

_PREFERRED = ("manual", "pinned", "searched", "fitted", "tracked")


class Saver:
    """Keeps the poses of one open session. Not locked by itself: the controller calls it under its lock."""

    def __init__(self, session: Session, store: AnnotationStore) -> None:
        """List the frames that have poses, and keep the models of the session as revisions."""
        self._session, self._store = session, store
        self._revisions = [store.add_model_revision(p.name, format_model(p.model)) for p in session.people]
        self._cells: dict[int, dict] = {}
        self._frames: list[list[int]] = [[] for _ in session.people]
        self._changes: list[tuple[int, int]] = []  # timeline version, frame
        self.timeline_version = 1
        """Rises with every change of stored poses."""
        self.error: str | None = None
        """Why the last edit is not on disk; None where it is."""
        self._reload()

    def pose(self, person: int, frame: int) -> Shown | None:
        """The stored pose of a person on a frame."""
        record = self._store.pose(self._session.people[person].name, frame)
        if record is None or len(record.values) != len(self._session.people[person].model.value_names):
            return None
        return Shown(record.values, _summary(record.sources))

    def nearest_pose(self, person: int, frame: int) -> Array | None:
        """The stored pose nearest in time, the earlier one where two are as near; None where there is none."""
        frames = self._frames[person]
        at = bisect_left(frames, frame)
        near = sorted(frames[max(0, at - 1) : at + 1], key=lambda f: (abs(f - frame), f))
        found = self.pose(person, near[0]) if near else None
        return None if found is None else found.values

    def save(self, state: State, label: str, source: str, amend: int | None) -> int | None:
        """Write the poses shown that are not drafts and differ from the stored ones.

        Args:
            state: with the poses.
            label: what the history says.
            source: who set the values that changed.
            amend: the entry of the history to add to; None makes a new one.

        Returns:
            Id of the entry; None where nothing was written. Where writing fails, `error` says why.
        """
        changes = []
        for person, (shown, revision) in enumerate(zip(state.people, self._revisions, strict=True)):
            name = self._session.people[person].name
            stored = self._store.pose(name, state.frame)
            if shown.source is None or (stored is not None and np.array_equal(stored.values, shown.values)):
                continue
            known = stored is not None and len(stored.values) == len(shown.values)
            sources = tuple(
                stored.sources[i] if known and stored.values[i] == value else source  # type: ignore[union-attr]
                for i, value in enumerate(shown.values)
            )
            keyframe = source == "manual" or (stored is not None and stored.keyframe)
            told = {"theta_px": state.theta_px, "outliers": state.outliers} if source == "searched" else {}
            record = PoseRecord(shown.values, sources, revision, keyframe, "", state.cost_px, told)
            changes.append(PoseChange(name, state.frame, record))
        if not changes:
            return amend
        try:
            if amend is None:
                amend = self._store.commit(f"{label}, frame {state.frame}", changes).edit
            else:
                self._store.amend(amend, changes)
            self.error = None
        except TrackerError as error:
            self.error = str(error)
            return None
        self._note(state.frame)
        return amend

    def undo(self) -> int | None:
        """Take back the last entry of the history; returns the first frame it is about, None where there is none."""
        entry = self._next_undo()
        if entry is None:
            return None
        self._store.undo()
        return self._moved(entry)

    def redo(self) -> int | None:
        """Do again what was taken back last; returns the first frame it is about, None where there is none."""
        entry = self._next_redo()
        if entry is None:
            return None
        self._store.redo()
        return self._moved(entry)

    def undo_label(self) -> str | None:
        """What undo would take back."""
        entry = self._next_undo()
        return None if entry is None else entry.label

    def redo_label(self) -> str | None:
        """What redo would do again."""
        entry = self._next_redo()
        return None if entry is None else entry.label

    def timeline(self, since: int) -> dict[int, dict | None]:
        """Cells of the frames that changed after a version of the timeline; all for 0."""
        if since <= 0:
            return dict(self._cells)
        frames = {frame for version, frame in self._changes if version > since}
        return {frame: self._cells.get(frame) for frame in frames}

    def _next_undo(self) -> HistoryEntry | None:
        return next((e for e in self._store.history(1) if not e.undone), None)

    def _next_redo(self) -> HistoryEntry | None:
        return next((e for e in self._store.history(1) if e.undone), None)

    def _moved(self, entry: HistoryEntry) -> int | None:
        frames = self._store.frames_of(entry.edit)
        self._reload(frames)
        return frames[0] if frames else None

    def _reload(self, changed: Sequence[int] = ()) -> None:
        """List all frames anew, and note those that changed."""
        self._cells = {}
        for person, info in enumerate(self._session.people):
            rows = self._store.frames(info.name)
            self._frames[person] = [row.frame for row in rows]
            for row in rows:
                self._cells.setdefault(
                    row.frame, {"source": row.source, "cost_px": row.cost_px, "keyframe": row.keyframe}
                )
        self.timeline_version += 1
        self._changes += [(self.timeline_version, frame) for frame in changed]

    def _note(self, frame: int) -> None:
        """Bring the cell of one frame up to date."""
        for person, info in enumerate(self._session.people):
            record = self._store.pose(info.name, frame)
            if record is not None:
                source = _summary(record.sources)
                self._cells[frame] = {"source": source, "cost_px": record.cost_px, "keyframe": record.keyframe}
                if frame not in self._frames[person][bisect_left(self._frames[person], frame) :][:1]:
                    insort(self._frames[person], frame)
        self.timeline_version += 1
        self._changes.append((self.timeline_version, frame))


def _summary(sources: tuple[str, ...]) -> str:
    """One word for where a pose came from: that of the values nearest to a person's hand."""
    return next((s for s in _PREFERRED if s in sources), sources[0])
