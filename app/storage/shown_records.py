"""Compare a shown pose with its stored record: sources of its values, marks, equality."""

from dataclasses import replace

import numpy as np

from app.state.people import ShownPose
from tracker.session.store.records import SOURCES, PoseRecord


def sources_of(stored: PoseRecord | None, shown: ShownPose, source: str) -> tuple[str, ...]:
    """Return the source of each value of a shown pose; values that an edit did not concern keep theirs."""
    given = shown.sources or (source,) * len(shown.values)
    if stored is None or len(stored.values) != len(shown.values):
        return tuple(new or source for new in given)
    is_kept = [not new for new in given] if shown.sources else stored.values == shown.values
    return tuple(old if kept else new for kept, old, new in zip(is_kept, stored.sources, given, strict=True))


def with_marks_of(stored: PoseRecord | None, record: PoseRecord) -> PoseRecord:
    """Return a new record with the marks and doubts of the stored one."""
    if stored is None:
        return replace(record, keyframe=False)
    return replace(
        record, keyframe=stored.keyframe, status=stored.status, remark=stored.remark, reviewed=stored.reviewed,
        limbs_lost=stored.limbs_lost,
    )  # fmt: skip


def is_same(stored: PoseRecord, shown: ShownPose, revision: int) -> bool:
    """Return whether a shown pose is the stored one, in the same body."""
    return stored.model_revision == revision and np.array_equal(stored.values, shown.values)


def main_source(sources: tuple[str, ...]) -> str:
    """Return the source that summarizes a pose: the one nearest to a person's own work."""
    return min(sources, key=SOURCES.index)
