"""Index of the stored frames: which frames of each person have a pose, and the cells of the timeline."""

from bisect import bisect_left
from collections.abc import Sequence

from app.storage.timeline_cells import TimelineCells
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import FrameRow


class FrameIndex:
    """The frames of one session that have poses. The caller holds the session's lock."""

    def __init__(self, store: AnnotationStore, names: Sequence[str]) -> None:
        """List all stored frames.

        Args:
            store: annotations of the session.
            names: of the people.
        """
        self._store, self._names = store, list(names)
        self._cells = TimelineCells(names)
        self._frames: list[list[int]] = []
        rows: dict[int, dict[str, FrameRow]] = {}
        for name in self._names:
            found = store.frames(name)
            self._frames.append([row.frame for row in found])
            for row in found:
                rows.setdefault(row.frame, {})[name] = row
        self._cells.begin(rows)

    @property
    def version(self) -> int:
        """Increases with every change of stored poses."""
        return self._cells.version

    def frames(self, person: int) -> list[int]:
        """Return the frames on which a person has a stored pose, ascending."""
        return list(self._frames[person])

    def within(self, person: int, frames: range) -> list[int]:
        """Return the frames of a range on which a person has a stored pose, ascending."""
        listed = self._frames[person]
        return listed[bisect_left(listed, frames.start) : bisect_left(listed, frames.stop)]

    def nearest(self, person: int, frame: int) -> int | None:
        """Return the frame nearest in time with a stored pose, the earlier one of two; None if there is none."""
        frames = self._frames[person]
        at = bisect_left(frames, frame)
        near = sorted(frames[max(0, at - 1) : at + 1], key=lambda f: (abs(f - frame), f))
        return near[0] if near else None

    def timeline(self, since: int, person: int | None = None) -> dict[int, dict | None]:
        """Return the cells of the frames that changed after a version of the timeline.

        Args:
            since: the version; 0 returns all cells.
            person: index of one of several people; None summarizes all people.
        """
        return self._cells.since(since, None if person is None else self._names[person])

    def update(self, frames: Sequence[int]) -> None:
        """Read frames again that changed, ascending."""
        if not frames:
            return
        rows: dict[int, dict[str, FrameRow]] = {}
        for name, listed in zip(self._names, self._frames, strict=True):
            found = self._store.frames(name, range(frames[0], frames[-1] + 1))
            for row in found:
                rows.setdefault(row.frame, {})[name] = row
            # Only the span between the first and the last changed frame is replaced.
            span = slice(bisect_left(listed, frames[0]), bisect_left(listed, frames[-1] + 1))
            listed[span] = [row.frame for row in found]
        self._cells.change(frames, rows)
