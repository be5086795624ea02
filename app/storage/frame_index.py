"""Index of the stored frames: which frames of each person have a pose, and the cells of the timeline.

Cells of the timeline: a summary of each frame, for all people together and for each of several.
"""

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile

from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import SOURCES, FrameRow


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


_STATUS_RANKS = {status: i for i, status in enumerate(("lost", "doubtful", "good", ""))}
"""The worst status first."""
_SOURCE_RANKS = {source: i for i, source in enumerate(SOURCES)}


class TimelineCells:
    """The cells of all frames that have poses. The caller holds the session's lock."""

    def __init__(self, names: Iterable[str]) -> None:
        """Begin without poses.

        Args:
            names: of the people.
        """
        self._all: dict[int, dict] = {}
        names = list(names)
        self._lanes: dict[str, dict[int, dict]] = {name: {} for name in names} if len(names) > 1 else {}
        self._changed: dict[int, int] = {}  # frame -> version of its last change, latest last
        self.version = 1
        """Increases with every change of stored poses."""

    def begin(self, rows: Mapping[int, Mapping[str, FrameRow]]) -> None:
        """List all frames, from the rows of the people who have a pose there."""
        self._put(rows)

    def change(self, frames: Iterable[int], rows: Mapping[int, Mapping[str, FrameRow]]) -> None:
        """Update some frames; those without rows no longer have a pose."""
        changed = set(frames)
        self.version += 1
        for frame in changed:
            for cells in (self._all, *self._lanes.values()):
                cells.pop(frame, None)
            self._changed.pop(frame, None)
            self._changed[frame] = self.version
        self._put({frame: people for frame, people in rows.items() if frame in changed})

    def since(self, version: int, name: str | None = None) -> dict[int, dict | None]:
        """Return the cells of the frames that changed after a version.

        Args:
            version: of the timeline; 0 returns all cells.
            name: of one of several people; None summarizes all people.
        """
        cells = self._all if name is None else self._lanes[name]
        if version <= 0:
            return dict(cells)
        latest = takewhile(lambda change: change[1] > version, reversed(self._changed.items()))
        return {frame: cells.get(frame) for frame, _ in latest}

    def _put(self, rows: Mapping[int, Mapping[str, FrameRow]]) -> None:
        if not self._lanes:
            self._all |= {frame: _cell(row) for frame, people in rows.items() for row in people.values()}
            return
        for frame, people in rows.items():
            for name, row in people.items():
                self._lanes[name][frame] = _cell(row)
            self._all[frame] = _summary(people)


def _cell(row: FrameRow) -> dict:
    """Return the cell of one person on a frame. A long recording has a million: each field is taken once."""
    is_assessed = row.status in ("lost", "doubtful")
    return {
        "source": row.source,
        "cost_px": None if row.cost_px is None else round(row.cost_px, 3),
        "keyframe": row.keyframe,
        "status": row.status,
        "remark": row.remark,
        "reviewed": row.reviewed,
        "ambiguous": row.ambiguous,
        "limbs_lost": tuple(round(p, 3) for p in row.limbs_lost) if is_assessed else (),
    }


def _summary(rows: Mapping[str, FrameRow]) -> dict:
    """Summarize a frame: the worst status of the people, and the source nearest to a person's own work.

    The cost is that of the last change, which concerns all people as they are now. The limbs of several people are
    named in their own lanes.
    """
    first, *others = rows.values()
    cell = _cell(first)
    if not others:
        return cell
    for row in others:
        if _SOURCE_RANKS[row.source] < _SOURCE_RANKS[cell["source"]]:
            cell["source"] = row.source
        if _STATUS_RANKS[row.status] < _STATUS_RANKS[cell["status"]]:
            cell["status"] = row.status
        cell["keyframe"] |= row.keyframe
        cell["reviewed"] &= row.reviewed
        cell["ambiguous"] |= row.ambiguous
    cell["cost_px"] = _cell(max(rows.values(), key=lambda row: row.change))["cost_px"]
    cell["remark"] = "; ".join(f"{name}: {row.remark}" for name, row in rows.items() if row.remark)
    cell["limbs_lost"] = ()
    return cell
