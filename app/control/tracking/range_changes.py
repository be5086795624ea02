"""Changes of poses over a range of frames: interpolated poses, smoothed or shifted curves, marks."""

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from app.control.session.session_state import SessionState
from tracker.body.motion.interpolation import interpolate_pose
from tracker.compute.sampling import without_gaps
from tracker.estimation.posing.dof_series import move_dofs, smooth_dofs
from tracker.geometry.arrays import Array
from tracker.pipeline.marked_points import without_moved
from tracker.session.locked_dofs import require_unlocked
from tracker.session.store.records import BETWEEN, SEEN, FrameRow, MarkChange, PoseChange, PoseRecord
from tracker.validation import ROUNDING

Mark = Literal["keyframe", "reviewed", "unreviewed", "none"]
"""`unreviewed` leaves keyframes unchanged; `none` removes the mark of keyframes too."""

AT_ONCE = 500
"""Frames written at once; shorter work is done before the call returns."""


def marked(name: str, row: FrameRow, mark: Mark) -> MarkChange | None:
    """Return the change that gives a frame a mark; None if it has the mark."""
    keyframe = mark == "keyframe" or (mark != "none" and row.keyframe)
    reviewed = keyframe or mark == "reviewed"
    same = keyframe == row.keyframe and reviewed == row.reviewed
    return None if same else MarkChange(name, row.frame, keyframe, reviewed)


def interpolated(session_state: SessionState, person: int, start: int, end: int) -> Iterator[PoseChange]:
    """Yield interpolated poses for the frames between two frames."""
    saver, model = session_state.saver, session_state.present[person]
    ends = [saver.pose_now(person, frame) for frame in (start, end)]
    if ends[0] is None or ends[1] is None:  # the body has other values
        return
    revision, sources = saver.revisions.current(person), ("interpolated",) * len(ends[0])
    frames = range(start + 1, end)
    for at in range(0, len(frames), AT_ONCE):
        piece = frames[at : at + AT_ONCE]
        shares = (np.array(piece) - start) / (end - start)
        for frame, values in zip(piece, interpolate_pose(model, ends[0], ends[1], shares), strict=True):
            settings = {"method": "interpolate", BETWEEN: [start, end]}
            record = PoseRecord(values, sources, revision, settings=settings)
            yield PoseChange(session_state.session.people[person].name, frame, record)


def edited(
    session_state: SessionState, person: int, frames: range, dofs: Sequence[int], verb: str, amount: Array | float
) -> list[PoseChange]:
    """Edit degrees of freedom on each stretch of successive frames with poses; return the poses that change.

    Args:
        session_state: holds the state.
        person: index of the person.
        frames: of which the poses change.
        dofs: indices of the degrees of freedom.
        verb: `smooth`, which leaves keyframes, or `shift`.
        amount: cutoff in Hz, or shift of each in rad or metres; see `smooth_dofs` and `move_dofs`.

    Raises:
        TrackerError: a degree of freedom is locked, or the cutoff is not below half the frame rate.
    """
    saver, session, model = session_state.saver, session_state.session, session_state.present[person]
    require_unlocked(model, session_state.state.locked[person], dofs)
    name, revision = session.people[person].name, saver.revisions.current(person)
    stored = saver.store.poses(name, frames)
    records = {f: r for f, r in stored.items() if saver.revisions.fits(person, r.model_revision)}
    source = "smoothed" if verb == "smooth" else "manual"
    own = session_state.free_sources(person, source, [model.dof_names[d] for d in dofs])
    changes = []
    for stretch in without_gaps(records):
        old = [records[frame] for frame in stretch]
        before = np.stack([saver.revisions.in_present_body(person, r.values, r.model_revision) for r in old])
        if verb == "smooth":
            after = smooth_dofs(model, before, dofs, session.fps, float(amount))
        else:
            after = move_dofs(model, before, dofs, amount)
        for frame, record, was, values in zip(stretch.tolist(), old, before, after, strict=True):
            if np.allclose(values, was, rtol=0.0, atol=ROUNDING) or (verb == "smooth" and record.keyframe):
                continue
            sources = tuple(mine or former for mine, former in zip(own, record.sources, strict=True))
            seen = without_moved(model, record.settings.get(SEEN, {}), was, values)
            settings = {SEEN: seen} if seen else {}
            pose = PoseRecord(values, sources, revision, record.keyframe, settings=settings, reviewed=record.reviewed)
            changes.append(PoseChange(name, frame, pose))
    return changes
