"""Smooth the poses of a finished run: what a run keeps of its frames for that, and the rows that take their place."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.geometry.arrays import Array
from tracker.motion.smoothing import PoseTrack, smooth_poses
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.confidence import LOST_FROM
from tracker.tracking.subjects import Subjects


class TrackedRows:
    """The rows that a run has stored for one person, with the covariances of their poses."""

    def __init__(self) -> None:
        """Hold no row yet."""
        self._changes: dict[int, PoseChange] = {}
        self._covariances: dict[int, NDArray[np.float32]] = {}  # upper triangle: half of the memory

    def add(self, change: PoseChange, covariance: Array) -> None:
        """Add a row, or replace that of the same frame; `covariance` is (n_dofs, n_dofs)."""
        self._changes[change.frame] = change
        self._covariances[change.frame] = covariance[np.triu_indices(len(covariance))].astype(np.float32)

    def record(self) -> dict[str, str]:
        """Return the covariances by frame as texts, for a run that is resumed later."""
        return {str(f): base64.b64encode(c.tobytes()).decode() for f, c in self._covariances.items()}

    def restore(self, change: PoseChange, text: str) -> None:
        """Add a row of an interrupted run with what `record` returned of its frame."""
        self._changes[change.frame] = change
        self._covariances[change.frame] = np.frombuffer(base64.b64decode(text), np.float32)

    def smoothed(self, subjects: Subjects, person: int, fps: float) -> list[PoseChange]:
        """Return the rows with smoothed poses, in the order of time.

        Status, costs, notes and alternatives stay those of the tracked pose. A lost limb, or all of a lost frame if no
        limb is known to be lost, is not a measurement. Locked degrees of freedom keep their values.

        Args:
            subjects: of the run; keyframes are exact.
            person: index of the person.
            fps: frame rate, 1/s.
        """
        model = subjects.models[person]
        keyframes = {f: of_people[person] for f, of_people in subjects.keyframes.items() if person in of_people}
        rows = {f: c.pose for f, c in self._changes.items() if f not in keyframes and c.pose is not None}
        if not rows:
            return []
        at = sorted({*rows, *keyframes})
        n = model.n_dofs
        track = PoseTrack(
            model,
            np.array(at) / fps,
            np.array([keyframes[f] if f in keyframes else rows[f].values for f in at]),
            np.array([np.zeros((n, n)) if f in keyframes else _unpacked(self._covariances[f], n) for f in at]),
            np.array([f in keyframes for f in at]),
            np.array([np.ones(n, dtype=bool) if f in keyframes else _trusted(model, rows[f]) for f in at]),
        )
        out = []
        for frame, pose in zip(at, smooth_poses(track), strict=True):
            if frame in rows:
                values = with_locked_dofs(model, pose, rows[frame].values, subjects.active_dofs[person])
                out.append(replace(self._changes[frame], pose=replace(rows[frame], values=values)))
        return out


def resumed_rows(
    rows: Mapping[int, tuple[PoseChange, ...]], records: Mapping[str, Mapping[str, str]]
) -> dict[int, TrackedRows]:
    """Return the rows of an interrupted run by person; those whose covariance is not recorded are left out.

    Args:
        rows: stored rows by index of the person.
        records: what `TrackedRows.record` returned, by index of the person as text.
    """
    out = {}
    for person, changes in rows.items():
        out[person], known = TrackedRows(), records.get(str(person), {})
        for change in changes:
            if str(change.frame) in known:
                out[person].restore(change, known[str(change.frame)])
    return out


def _unpacked(packed: NDArray[np.float32], n: int) -> Array:
    out = np.zeros((n, n))
    rows, columns = np.triu_indices(n)
    out[rows, columns] = out[columns, rows] = packed
    return out


def _trusted(model: BodyModel, row: PoseRecord) -> NDArray[np.bool_]:
    """Return the degrees of freedom that a tracked pose measures, (n_dofs,)."""
    out = np.ones(model.n_dofs, dtype=bool)
    if row.status != "lost":
        return out
    lost: Sequence[bool] = [p > LOST_FROM for p in row.limbs_lost]
    if not any(lost):
        return ~out
    for limb, is_lost in zip(limbs(model), lost, strict=False):
        out[limb.dofs] &= not is_lost
    return out
