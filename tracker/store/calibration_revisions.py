"""Revisions of the calibration of a session, as its annotations store them.

A revision is a calibration with a number from 1 on. The present one is that of the last entry of the history that
changed it. A pose belongs to the revision that was present when it was made.
"""

from bisect import bisect_right
from collections.abc import Mapping

from tracker.store.annotation_store import AnnotationStore

CALIBRATIONS = "calibrations"
"""Setting of the session: the revisions, in order, each with its cameras as `toml`, their `clocks` and its `time`."""
CALIBRATION_EDITS = "calibration_edits"
"""Setting of the session: by entry of the history, the revisions before and after it."""


def present_revision(store: AnnotationStore) -> int | None:
    """Return the number of the present calibration; None if it has never been changed."""
    edits = _edits(store)
    done = set(store.done_edits())
    applied = [after for edit, (_, after) in edits.items() if edit in done]
    return applied[-1] if applied else min((before for before, _ in edits.values()), default=None)


def revisions_of_poses(store: AnnotationStore, person: str) -> dict[int, int]:
    """Return the revision of the calibration that each pose of a person was made with, by frame.

    It is empty if the calibration has never been changed.
    """
    edits = _edits(store)
    if not edits:
        return {}
    done = set(store.done_edits())
    applied = [edit for edit in edits if edit in done]
    first = min(before for before, _ in edits.values())
    of_entries = [first, *(edits[edit][1] for edit in applied)]
    return {frame: of_entries[bisect_right(applied, edit)] for frame, edit in store.pose_edits(person).items()}


def _edits(store: AnnotationStore) -> dict[int, tuple[int, int]]:
    """Return the revisions before and after each entry of the history that changed the calibration, ascending."""
    stored: Mapping[str, tuple[int, int]] = store.setting(CALIBRATION_EDITS, {})
    return {int(edit): (int(stored[edit][0]), int(stored[edit][1])) for edit in sorted(stored, key=int)}
