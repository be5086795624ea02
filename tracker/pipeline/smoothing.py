"""Finish a run: smooth its poses, and classify them again.

A run keeps covariances and features of its frames. It gets rows that replace those of the tracked poses.
"""

import base64
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.progress import result_of
from tracker.errors import DamagedStoreError
from tracker.fitting.consensus import Consensus, agreement, consensus
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.fitting.hypothesis import limbs_elsewhere
from tracker.geometry.arrays import Array
from tracker.motion.shortest_step import nearest_equivalent
from tracker.pipeline.assessed_poses import (
    assessed_by_features,
    assessed_by_tracks,
    assessed_keyframe,
    with_alternatives,
    with_repair,
)
from tracker.pipeline.keyframe_stretches import Seam, seam_of, with_seam
from tracker.pipeline.run_repair import RepairedPose
from tracker.store.records import AssessmentChange, PoseChange, PoseRecord
from tracker.tracking.confidence import PoseQuality, frame_features
from tracker.tracking.estimate import OtherPass
from tracker.tracking.run_confidence import LOST_FROM, run_features, smoothing_steps
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import PathEvidence
from tracker.tracking.view_tracks import FrameTracks
from tracker.trajectory.pose_track import PoseTrack, smooth_poses


class TrackedRows:
    """The rows that a run has stored for one person, with the covariances and status features of their poses."""

    def __init__(self) -> None:
        """Hold no row yet."""
        self._changes: dict[int, PoseChange] = {}
        self._covariances: dict[int, NDArray[np.float32]] = {}  # upper triangle: half of the memory
        self._features: dict[int, NDArray[np.float32]] = {}  # of frames whose limbs were assessed
        self._unseen = set[int]()  # frames on which no edge is near the body
        self.tracks: dict[int, FrameTracks] = {}
        """By frame, the poses by tracks without a view each."""
        self._repaired: Mapping[int, RepairedPose] = {}
        self._other_poses: dict[int, tuple[tuple[int, int], Array]] = {}  # with the keyframes that they lie between

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

    def add_tracks(self, frame: int, tracks: FrameTracks) -> None:
        """Add the poses of a frame by tracks without a view each."""
        self.tracks[frame] = tracks

    def add_repaired(self, poses: Mapping[int, RepairedPose]) -> None:
        """Add the poses by frame after their repair."""
        self._repaired = poses

    def add_other_pass(self, other: OtherPass) -> None:
        """Add the poses between two keyframes by the pass that was not selected."""
        self._other_poses |= {frame: (other.between, pose) for frame, pose in other.poses.items()}

    def covariance(self, frame: int, n_dofs: int) -> Array:
        """Return the covariance of the tracked pose of a frame, (n_dofs, n_dofs)."""
        return _unpacked(self._covariances[frame], n_dofs)

    @property
    def is_compared(self) -> bool:
        """Whether other tracks of the same frames are known, with which the poses have a consensus."""
        return bool(self.tracks or self._other_poses)

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

    def finished(
        self, subjects: Subjects, person: int, fps: float, smooth: bool = True, evidence: PathEvidence | None = None
    ) -> Generator[int, None, list[PoseChange]]:
        """Find the consensus poses, smoothed, and their final statuses.

        Costs stay those of the tracked pose, and so does the status of a pose whose limbs were not assessed.
        Alternatives stay where the repair has not compared them.

        Args:
            subjects: of the run; keyframes are exact.
            person: index of the person.
            fps: frame rate, 1/s.
            smooth: whether the poses are smoothed.
            evidence: of the frames, around the poses before smoothing; None for their estimates alone.

        Yields:
            The number of frames whose evidence was read so far.

        Returns:
            Their rows, in the order of time.
        """
        model, active = subjects.models[person], subjects.active_dofs[person]
        seams = self._seams(model, {k: of_one[person] for k, of_one in subjects.keyframes.items() if person in of_one})
        agreed = {f: self.consensus(model, f, active) for f in self._changes.keys() & self.tracks.keys()}
        changes = self._with_poses(model, agreed, active)
        smoothed, by_motion = [*changes.values()], None
        if smooth:
            smoothed, by_motion = yield from self.smoothed(subjects, person, fps, evidence, changes)
        features = self.run_features(model, by_motion)
        out = []
        for change in smoothed:
            assert change.pose is not None
            pose, frame, is_ambiguous = change.pose, change.frame, len(change.alternatives) > 0
            if frame in agreed and frame not in self._unseen:
                tracks, own = self.tracks[frame], features.get(frame)
                if frame in self._repaired:
                    pose = with_repair(model, pose, self._repaired[frame])
                    change = with_alternatives(change, self._repaired[frame])
                pose = assessed_by_tracks(
                    model, pose, agreed[frame], tracks, is_ambiguous, own, self._repaired.get(frame)
                )
            elif frame in features:
                pose = assessed_by_features(model, pose, features[frame], is_ambiguous)
            if frame in seams:
                pose = with_seam(model, pose, seams[frame])
            out.append(replace(change, pose=pose))
        return out

    def assessed_keyframes(self, model: BodyModel, name: str, keyframes: Mapping[int, Array]) -> list[AssessmentChange]:
        """Return what is known about the keyframes of a person by now.

        Args:
            model: the body.
            name: of the person.
            keyframes: by frame, their poses, (n_values,).
        """
        found = (
            assessed_keyframe(
                model, name, k, PoseRecord(pose, ("manual",) * len(pose), 0), self.tracks[k], self._repaired.get(k)
            )
            for k, pose in sorted(keyframes.items())
            if k in self.tracks
        )
        return [change for change in found if change is not None]

    def consensus(self, model: BodyModel, frame: int, active: NDArray[np.bool_] | None) -> Consensus:
        """Return the consensus of the tracked pose of a frame and of those by tracks without a view each.

        Between two keyframes, the pose by the other pass takes part. A repaired pose takes the place of the consensus.
        """
        tracks, repaired = self.tracks[frame], self._repaired.get(frame)
        trust = tracks.trust if repaired is None else tracks.trust * repaired.trust
        return agreement(model, self.best_pose(model, frame, active), tracks.poses, trust)

    def best_pose(self, model: BodyModel, frame: int, active: NDArray[np.bool_] | None) -> Array:
        """Return the pose of a frame by all that is known before smoothing, (n_values,)."""
        if frame in self._repaired:
            return self._repaired[frame].pose
        return self._agreed_pose(model, frame, active)

    def _agreed_pose(self, model: BodyModel, frame: int, active: NDArray[np.bool_] | None) -> Array:
        """Return the pose on which all that is known of a frame agrees, (n_values,)."""
        pose, n_limbs = self._changes[frame].pose, len(limbs(model))
        assert pose is not None
        others, trust = [], [1 - np.array(pose.limbs_lost) if pose.limbs_lost else np.ones(n_limbs)]
        if frame in self.tracks:
            others += [*self.tracks[frame].poses]
            trust += [*self.tracks[frame].trust]
        if frame in self._other_poses:
            others.append(self._other_poses[frame][1])
            apart = limbs_elsewhere(PosedBody(model, pose.values), PosedBody(model, others[-1]))
            trust.append(trust[0] * [limb.name not in apart for limb in limbs(model)])  # alike: the mean of both
        if not others:
            return pose.values
        return consensus(model, pose.values, np.array(others), np.array(trust), active).pose

    def _seams(self, model: BodyModel, keyframes: Mapping[int, Array]) -> dict[int, Seam]:
        """Return how far the two passes lie apart on each frame between two keyframes."""
        out = {}
        for frame in self._changes.keys() & self._other_poses.keys():
            (between, other), pose = self._other_poses[frame], self._changes[frame].pose
            assert pose is not None
            out[frame] = seam_of(model, pose.values, other, between, [keyframes[k] for k in between])
        return out

    def _with_poses(
        self, model: BodyModel, agreed: Mapping[int, Consensus], active: NDArray[np.bool_] | None
    ) -> dict[int, PoseChange]:
        """Return the rows with the consensus of the tracks, and what of it is lost, on some frames.

        Args:
            model: the body.
            agreed: the consensus with the tracks without a view each, by frame.
            active: degrees of freedom that may move, (n_dofs,); None: all.
        """
        out = dict(self._changes)
        for frame in self._changes.keys() & self._other_poses.keys() - agreed.keys():
            change = out[frame]
            assert change.pose is not None
            pose = replace(change.pose, values=self._agreed_pose(model, frame, active))
            out[frame] = replace(change, pose=pose)
        for frame, found in agreed.items():
            change = out[frame]
            assert change.pose is not None
            pose = replace(change.pose, values=found.pose)
            if frame in self._repaired and frame not in self._unseen:
                pose = assessed_by_tracks(model, pose, found, self.tracks[frame], False)
            out[frame] = replace(change, pose=pose)
        return out

    def run_features(self, model: BodyModel, by_motion: Mapping[int, Array] | None) -> dict[int, Array]:
        """Return the features of all limbs by frame, (n_limbs, 8) each, from which their final statuses follow.

        Args:
            model: the body.
            by_motion: poses from `smoothed`; None if nothing was smoothed.
        """
        known = {f: pose.values for f, c in sorted(self._changes.items()) if (pose := c.pose) is not None}
        before = {f: pose for f, pose in known.items() if f in self._features and f in (by_motion or known)}
        if not before:
            return {}
        after = before if by_motion is None else by_motion
        steps = smoothing_steps(model, np.array([*before.values()]), np.array([after[f] for f in before]))
        found = run_features(np.array([self._features[f] for f in before], dtype=np.float64), steps)
        return dict(zip(before, found, strict=True))

    def smoothed(
        self, subjects: Subjects, person: int, fps: float, evidence: PathEvidence | None = None,
        changes: Mapping[int, PoseChange] | None = None,
    ) -> Generator[int, None, tuple[list[PoseChange], dict[int, Array]]]:  # fmt: skip
        """Smooth the poses; see `finished`.

        Everything else stays. A repaired pose is a measurement. Of others, a limb that is lost by the tracks without a
        view each is none. One that its own frame alone calls lost is: most of these are right, and the steps to their
        motion before and after, in which fast motion is not kept, tell more about them. Nothing of a lost frame is a
        measurement if no limb is known to be lost. Locked degrees of freedom keep their values.

        Args:
            subjects: of the run.
            person: index of the person.
            fps: frame rate, 1/s.
            evidence: see `finished`.
            changes: the rows to smooth, by frame; those of the tracker by default.

        Returns:
            The rows with smoothed poses, in the order of time, and the poses with doubted limbs by motion alone.
        """
        model, active = subjects.models[person], subjects.active_dofs[person]
        keyframes = {f: of_people[person] for f, of_people in subjects.keyframes.items() if person in of_people}
        changes = self._changes if changes is None else changes
        rows = {f: c.pose for f, c in changes.items() if f not in keyframes and c.pose is not None}
        if not rows:
            return [], {}
        at = sorted({*rows, *keyframes})
        n = model.n_dofs
        exact = keyframes.keys() | self._repaired.keys()
        measured = np.array([np.ones(n, dtype=bool) if f in exact else _measured(model, rows[f]) for f in at])
        track = PoseTrack(
            model,
            np.array(at) / fps,
            np.array([keyframes[f] if f in keyframes else rows[f].values for f in at]),
            np.array([np.zeros((n, n)) if f in keyframes else self.covariance(f, n) for f in at]),
            np.array([f in keyframes for f in at]),
            np.array([m if f in self.tracks else m | m.any() for f, m in zip(at, measured, strict=True)]),
            active,
            None if evidence is None else lambda t: evidence(at[t], person),
        )
        by_motion = result_of(smooth_poses(replace(track, trusted=measured, evidence=None), np.inf))
        found = yield from smooth_poses(track)
        out, here = [], found[0]
        for frame, pose in zip(at, found, strict=True):
            if frame in rows:
                near = nearest_equivalent(model, pose, here, active)
                here = with_locked_dofs(model, near, rows[frame].values, active)
                out.append(replace(changes[frame], pose=replace(rows[frame], values=here)))
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
