"""Smooth the poses of a run of a method that gives estimates alone, and classify them again.

A run keeps covariances and features of its frames. It gets rows that replace those of the tracked poses.
"""

import base64
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.compute.progress import result_of
from tracker.errors import DamagedStoreError
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.geometry.arrays import Array
from tracker.motion.shortest_step import nearest_equivalent
from tracker.pipeline.assessed_poses import assessed_by_features
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.confidence import PoseQuality, frame_features
from tracker.tracking.run_confidence import LOST_FROM, run_features, smoothing_steps
from tracker.tracking.subjects import Subjects
from tracker.trajectory.pose_track import PoseTrack, smooth_poses


class TrackedRows:
    """The rows that a run has stored for one person, with the covariances and status features of their poses."""

    def __init__(self) -> None:
        """Hold no row yet."""
        self._changes: dict[int, PoseChange] = {}
        self._covariances: dict[int, NDArray[np.float32]] = {}  # upper triangle: half of the memory
        self._features: dict[int, NDArray[np.float32]] = {}  # of frames whose limbs were assessed
        self._unseen = set[int]()  # frames on which no edge is near the body

    def __contains__(self, frame: int) -> bool:
        """Return whether there is a row of a frame."""
        return frame in self._changes

    def add(self, change: PoseChange, covariance: Array, quality: PoseQuality | None) -> None:
        """Add a row, or replace that of the same frame.

        Args:
            change: the row.
            covariance: of its pose, (n_dofs, n_dofs).
            quality: of its pose; None where it was not assessed.
        """
        frame = change.frame
        self._changes[frame] = change
        self._covariances[frame] = covariance[np.triu_indices(len(covariance))].astype(np.float32)
        self._features.pop(frame, None)
        self._unseen.discard(frame)
        if quality is not None and quality.is_unseen:
            self._unseen.add(frame)
        elif quality is not None:
            self._features[frame] = frame_features(quality).astype(np.float32)

    def pose(self, frame: int) -> PoseRecord | None:
        """Return the tracked pose of a frame; None without one."""
        return self._changes[frame].pose if frame in self._changes else None

    def covariance(self, frame: int, n_dofs: int) -> Array:
        """Return the covariance of the tracked pose of a frame, (n_dofs, n_dofs)."""
        return _unpacked(self._covariances[frame], n_dofs)

    def record(self) -> dict[str, list[str]]:
        """Return covariances and features by frame as texts, for a run that is resumed later."""
        arrays = {f: [c, *([self._features[f]] if f in self._features else [])] for f, c in self._covariances.items()}
        return {str(f): [base64.b64encode(a.tobytes()).decode() for a in some] for f, some in arrays.items()}

    def restore(self, change: PoseChange, texts: Sequence[str] | str) -> None:
        """Add a row of an interrupted run with its texts from `record`; older versions stored no features.

        Raises:
            ValueError: the texts are not those of a row.
        """
        known = [texts] if isinstance(texts, str) else texts
        covariance, *features = [np.frombuffer(base64.b64decode(text), np.float32) for text in known]
        n_dofs = int(np.sqrt(2 * covariance.size))
        is_triangle = 2 * covariance.size == n_dofs * (n_dofs + 1) > 0
        if not is_triangle or not all(np.isfinite(numbers).all() for numbers in (covariance, *features)):
            raise ValueError("expected the upper triangle of a covariance, and finite features")
        self._changes[change.frame], self._covariances[change.frame] = change, covariance
        if features and change.pose is not None:
            self._features[change.frame] = features[0].reshape(len(change.pose.limbs_lost), -1)
        elif change.pose is not None and change.pose.status == "lost":
            self._unseen.add(change.frame)

    def finished(self, subjects: Subjects, person: int, fps: float) -> Generator[int, None, list[PoseChange]]:
        """Smooth the poses, and give them their final statuses.

        Costs stay those of the tracked pose, and so does the status of a pose whose limbs were not assessed.

        Args:
            subjects: of the run; keyframes are exact.
            person: index of the person.
            fps: frame rate, 1/s.

        Yields:
            The number of frames that are taken in so far.

        Returns:
            Their rows, in the order of time.
        """
        model, out = subjects.models[person], []
        smoothed, by_motion = yield from self.smoothed(subjects, person, fps)
        features = self.run_features(model, by_motion)
        for change in smoothed:
            if change.pose is not None and change.frame in features:
                is_ambiguous = len(change.alternatives) > 0
                pose = assessed_by_features(model, change.pose, features[change.frame], is_ambiguous)
                change = replace(change, pose=pose)
            out.append(change)
        return out

    def run_features(self, model: BodyModel, by_motion: Mapping[int, Array]) -> dict[int, Array]:
        """Return the features of all limbs by frame, (n_limbs, 8) each, from which their final statuses follow.

        Args:
            model: the body.
            by_motion: poses from `smoothed`.
        """
        known = {f: pose.values for f, c in sorted(self._changes.items()) if (pose := c.pose) is not None}
        before = {f: pose for f, pose in known.items() if f in self._features and f in by_motion}
        if not before:
            return {}
        steps = smoothing_steps(model, np.array([*before.values()]), np.array([by_motion[f] for f in before]))
        found = run_features(np.array([self._features[f] for f in before], dtype=np.float64), steps)
        return dict(zip(before, found, strict=True))

    def smoothed(
        self, subjects: Subjects, person: int, fps: float
    ) -> Generator[int, None, tuple[list[PoseChange], dict[int, Array]]]:
        """Smooth the poses; see `finished`.

        A limb that its own frame alone calls lost is a measurement: most of these are right, and the steps to their
        motion before and after, in which fast motion is not kept, tell more about them. Nothing of a lost frame is
        one if no limb is known to be lost. Locked degrees of freedom keep their values.

        Args:
            subjects: of the run.
            person: index of the person.
            fps: frame rate, 1/s.

        Returns:
            The rows with smoothed poses, in the order of time, and the poses with doubted limbs by motion alone.
        """
        model, active = subjects.models[person], subjects.active_dofs[person]
        keyframes = {f: of_people[person] for f, of_people in subjects.keyframes.items() if person in of_people}
        rows = {f: c.pose for f, c in self._changes.items() if f not in keyframes and c.pose is not None}
        if not rows:
            return [], {}
        at = sorted({*rows, *keyframes})
        n = model.n_dofs
        measured = np.array([np.ones(n, bool) if f in keyframes else _measured(model, rows[f]) for f in at])
        track = PoseTrack(
            model,
            np.array(at) / fps,
            np.array([keyframes[f] if f in keyframes else rows[f].values for f in at]),
            np.array([np.zeros((n, n)) if f in keyframes else self.covariance(f, n) for f in at]),
            np.array([f in keyframes for f in at]),
            measured | measured.any(axis=1, keepdims=True),
            active,
        )
        by_motion = result_of(smooth_poses(replace(track, trusted=measured), np.inf))
        found = yield from smooth_poses(track)
        out, here = [], found[0]
        for frame, pose in zip(at, found, strict=True):
            if frame in rows:
                near = nearest_equivalent(model, pose, here, active)
                here = with_locked_dofs(model, near, rows[frame].values, active)
                out.append(replace(self._changes[frame], pose=replace(rows[frame], values=here)))
            else:
                here = pose
        return out, dict(zip(at, by_motion, strict=True))


def resumed_rows(
    rows: Mapping[int, tuple[PoseChange, ...]], records: Mapping[str, Mapping[str, Sequence[str] | str]]
) -> dict[int, TrackedRows]:
    """Return the rows of an interrupted run by person; those whose covariance is not recorded are left out.

    Args:
        rows: stored rows by index of the person.
        records: texts from `TrackedRows.record`, by index of the person as text.

    Raises:
        DamagedStoreError: texts are not those of a row.
    """
    out = {}
    for person, changes in rows.items():
        out[person], known = TrackedRows(), records.get(str(person), {})
        for change in changes:
            if str(change.frame) in known:
                try:
                    out[person].restore(change, known[str(change.frame)])
                except ValueError as error:
                    raise DamagedStoreError(
                        f"the setting of the interrupted run: expected the covariance and features of frame "
                        f"{change.frame}, found other bytes; track again with other settings, or from another frame"
                    ) from error
    return out


def _unpacked(packed: NDArray[np.float32], n: int) -> Array:
    out = np.zeros((n, n))
    rows, columns = np.triu_indices(n)
    out[rows, columns] = out[columns, rows] = packed
    return out


def _measured(model: BodyModel, row: PoseRecord) -> NDArray[np.bool_]:
    """Return the degrees of freedom that a tracked pose measures without doubt, (n_dofs,)."""
    out = np.ones(model.n_dofs, dtype=bool)
    if row.status != "lost":
        return out
    lost: Sequence[bool] = [p > LOST_FROM for p in row.limbs_lost]
    if not any(lost):
        return ~out
    for limb, is_lost in zip(limbs(model), lost, strict=False):
        out[limb.dofs] &= not is_lost
    return out
