"""The stretches between two keyframes, and which of them were not tracked from these keyframes as they are now."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from tracker.errors import Remedy, TrackerError
from tracker.pipeline.keyframe_seams import is_tracked_between
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore


class Stretch(NamedTuple):
    """Frames between two successive keyframes of a person."""

    first: int
    """The keyframe before them."""
    last: int
    """The keyframe after them."""

    @property
    def frames(self) -> range:
        """The frames with both keyframes."""
        return range(self.first, self.last + 1)

    @property
    def between(self) -> range:
        """The frames without the keyframes; at least one."""
        return range(self.first + 1, self.last)


def stretches(store: AnnotationStore, person: str, within: range) -> list[Stretch]:
    """Return the stretches of a person between keyframes of a range, in the order of time."""
    keyframes = [row.frame for row in store.frames(person, within) if row.keyframe]
    return [Stretch(a, b) for a, b in pairwise(keyframes) if b - a > 1]


def is_tracked(store: AnnotationStore, person: str, stretch: Stretch) -> bool:
    """Return whether all poses of a stretch were tracked from its keyframes as they are now."""
    records = store.poses(person, stretch.frames)
    ends = [records[k].values for k in (stretch.first, stretch.last)]
    between = [records.get(k) for k in stretch.between]
    return all(r is not None and is_tracked_between(r.settings, tuple(stretch), ends) for r in between)


def stretches_to_track(
    session: Session, store: AnnotationStore, people: Sequence[int], within: range
) -> dict[tuple[int, ...], list[Stretch]]:
    """Return the stretches that are to be tracked, by the indices of the people whose stretches they are.

    After the correction of a keyframe, these are the two beside it.

    Args:
        session: whose people they are.
        store: its annotations.
        people: indices of the people.
        within: frames that are looked at.

    Raises:
        TrackerError: nobody has two keyframes with other frames between them.
    """
    known = {i: stretches(store, session.people[i].name, within) for i in people}
    if not any(known.values()):
        raise TrackerError(
            f"expected two keyframes with other frames between them in frames {within[0]} to {within[-1]}, found none",
            Remedy("set_keyframes"),
        )
    owners: dict[Stretch, tuple[int, ...]] = {}
    for i, own in known.items():
        for stretch in own:
            if not is_tracked(store, session.people[i].name, stretch):
                owners[stretch] = (*owners.get(stretch, ()), i)
    out: dict[tuple[int, ...], list[Stretch]] = {}
    for stretch, who in sorted(owners.items()):
        out.setdefault(who, []).append(stretch)
    return out


def frames_of(some: Sequence[Stretch]) -> list[int]:
    """Return the frames of some stretches with their keyframes, ascending, each once."""

    def every() -> Iterator[int]:
        for stretch in some:
            yield from stretch.frames

    return sorted(set(every()))
