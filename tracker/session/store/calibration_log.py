"""The log of a session's calibrations: revisions with a number from 1 on, and the entries of the history that changed
from one to another.

The session's calibration is that of the last entry of the history that changed it. A pose belongs to the revision that
was present when it was made: that of the last such entry before its own.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from tracker.session.store.annotation_store import AnnotationStore

CALIBRATIONS = "calibrations"
"""Setting of the session: the revisions, in order, each with its cameras as `toml`, their `clocks`, the frames
that they have `lost`, and its `time`."""
CALIBRATION_EDITS = "calibration_edits"
"""Setting of the session: by entry of the history, the revisions before and after it."""
CALIBRATIONS_OF_EDITS = "calibrations_of_edits"
"""Setting of the session: by entry of the history, the revision that its poses were made with, where the order of the
history does not say so: in a merged session, another copy may have been corrected meanwhile."""


class PosedRevisions(NamedTuple):
    """The revision of the calibration of a session, and those of its poses."""

    present: int = 1
    """Number of the present calibration; 1 if it has never been changed."""
    of_poses: Mapping[str, Mapping[int, int]] = {}
    """By name of the person and frame; nobody if it has never been changed."""

    def of(self, person: str, frame: int) -> int:
        """Return the revision that a pose was made with."""
        return self.of_poses.get(person, {}).get(frame, 1)


def read_posed_revisions(path: Path, people: Sequence[str]) -> PosedRevisions:
    """Read the revisions of the poses of people.

    Args:
        path: the annotations, which other programs may have open; without the file there are none.
        people: names.

    Raises:
        SessionError: the annotations cannot be read.
    """
    if not path.exists():
        return PosedRevisions()
    with AnnotationStore(path, read_only=True) as store:
        return PosedRevisions(present_revision(store) or 1, {name: revisions_of_poses(store, name) for name in people})


def present_revision(store: AnnotationStore) -> int | None:
    """Return the number of the present calibration; None if it has never been changed."""
    edits = calibration_edits(store)
    done = set(store.done_edits())
    applied = [after for edit, (_, after) in edits.items() if edit in done]
    return applied[-1] if applied else min((before for before, _ in edits.values()), default=None)


def revisions_of_poses(store: AnnotationStore, person: str) -> dict[int, int]:
    """Return the revision of the calibration that each pose of a person was made with, by frame.

    It is empty if the calibration has never been changed.
    """
    edits = calibration_edits(store)
    if not edits:
        return {}
    done = set(store.done_edits())
    applied = [edit for edit in edits if edit in done]
    first = min(before for before, _ in edits.values())
    of_entries = [first, *(edits[edit][1] for edit in applied)]
    stated: Mapping[str, int] = store.setting(CALIBRATIONS_OF_EDITS, {})
    return {
        frame: stated.get(str(edit), of_entries[bisect_right(applied, edit)])
        for frame, edit in store.pose_edits(person).items()
    }


def calibration_edits(store: AnnotationStore) -> dict[int, tuple[int, int]]:
    """Return the revisions before and after each entry of the history that changed the calibration, ascending."""
    stored: Mapping[str, tuple[int, int]] = store.setting(CALIBRATION_EDITS, {})
    return {int(edit): (int(stored[edit][0]), int(stored[edit][1])) for edit in sorted(stored, key=int)}
