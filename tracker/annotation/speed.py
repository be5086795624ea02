"""The work of each annotator and reviewer, from the times of their edits and decisions."""

from collections import defaultdict
from datetime import datetime
from typing import NamedTuple

from tracker.annotation.plan import Task, read_tasks
from tracker.session.store.annotation_store import AnnotationStore


class Speed(NamedTuple):
    """The edits and decisions of one person."""

    name: str
    """Name of the annotator or reviewer; empty for nobody named."""
    verified: int
    """Planned poses that the person annotated and somebody verified."""
    edits: int
    """Edits of the history, undone ones too."""
    edit_seconds: float
    """Time that led to these edits, seconds, without pauses."""
    decisions: int
    """Tasks that the person verified, rejected or withdrew."""
    decision_seconds: float
    """Time that led to these decisions, seconds, without pauses."""

    @property
    def seconds_per_frame(self) -> float | None:
        """Seconds of editing per verified frame; None without one."""
        return self.edit_seconds / self.verified if self.verified else None

    @property
    def edits_per_frame(self) -> float | None:
        """Edits per verified frame; None without one."""
        return self.edits / self.verified if self.verified else None

    @property
    def seconds_per_decision(self) -> float | None:
        """Seconds per decision; None without one."""
        return self.decision_seconds / self.decisions if self.decisions else None


def measure_speed(store: AnnotationStore, pause_s: float = 60.0) -> list[Speed]:
    """Return how quickly each person annotates and reviews, by name.

    The time between two neighbouring events of a person, edits or decisions, belongs to the later one. Before the first
    event of a stretch no time is known.

    Args:
        store: annotations of the session.
        pause_s: a longer time between two events is a pause and not counted, seconds. An annotator looks at the views
            for some seconds between two edits; after a minute without any, other work is likelier. CVAT ends a stretch
            of work after 100 s.
    """
    events: dict[str, list[tuple[datetime, bool]]] = defaultdict(list)
    for author, time in store.tasks.edit_times():
        events[author].append((datetime.fromisoformat(time), False))
    for state in store.tasks.states():
        if state.state != "draft":  # planned again
            events[state.author].append((datetime.fromisoformat(state.time), True))
    verified = _verified_poses(store, read_tasks(store))
    return [_speed(name, len(verified[name]), sorted(events[name]), pause_s) for name in sorted(events)]


def _speed(name: str, verified: int, events: list[tuple[datetime, bool]], pause_s: float) -> Speed:
    counts, seconds = [0, 0], [0.0, 0.0]
    before: datetime | None = None
    for time, is_decision in events:
        counts[is_decision] += 1
        gap_s = (time - before).total_seconds() if before is not None else 0.0
        seconds[is_decision] += gap_s if gap_s <= pause_s else 0.0
        before = time
    return Speed(name, verified, counts[0], seconds[0], counts[1], seconds[1])


def _verified_poses(store: AnnotationStore, tasks: list[Task]) -> dict[str, set[tuple[str, int]]]:
    """Return person and frame of the verified poses by the name of their annotator.

    A pose of a task for anybody belongs to the author of the last keyframe there.
    """
    last: dict[tuple[str, int], str] = {}
    makers: dict[tuple[str, int], set[str]] = defaultdict(set)
    for made in store.tasks.keyframe_edits():
        last[made.person, made.frame] = made.author
        makers[made.person, made.frame].add(made.author)
    verified: dict[str, set[tuple[str, int]]] = defaultdict(set)
    for row in (task.row for task in tasks if task.state == "verified"):
        at = row.person, row.frame
        if at in last:
            verified[row.annotator if row.annotator in makers[at] else last[at]].add(at)
    return verified
