"""Cells of the timeline: a summary of each frame, for all people together and for each of several."""

from collections.abc import Iterable, Mapping
from itertools import takewhile

from tracker.store.records import SOURCES, FrameRow

_WORST_FIRST = ("lost", "doubtful", "good", "")


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
        self._all |= {frame: _cell(people) for frame, people in rows.items()}
        for name, lane in self._lanes.items():
            lane |= {frame: _cell({name: people[name]}) for frame, people in rows.items() if name in people}


def _cell(rows: Mapping[str, FrameRow]) -> dict:
    """Summarize a frame: the worst status and cost of the people, and the source nearest to a person's own work."""
    costs = [row.cost_px for row in rows.values() if row.cost_px is not None]
    # Several people have lanes of their own, which name their limbs.
    alone = next(iter(rows.values())) if len(rows) == 1 else None
    is_assessed = alone is not None and alone.status in ("lost", "doubtful")
    remarks = [row.remark if len(rows) == 1 else f"{name}: {row.remark}" for name, row in rows.items() if row.remark]
    return {
        "source": min((row.source for row in rows.values()), key=SOURCES.index),
        "cost_px": round(max(costs), 3) if costs else None,
        "keyframe": any(row.keyframe for row in rows.values()),
        "status": min((row.status for row in rows.values()), key=_WORST_FIRST.index),
        "remark": "; ".join(remarks),
        "reviewed": all(row.reviewed for row in rows.values()),
        "ambiguous": any(row.ambiguous for row in rows.values()),
        "limbs_lost": tuple(round(p, 3) for p in alone.limbs_lost) if alone is not None and is_assessed else (),
    }
