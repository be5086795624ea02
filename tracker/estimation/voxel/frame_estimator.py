"""Estimate the poses of all people frame by frame from voxels: predict, carve, label, measure, update, assess."""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import PosedBody
from tracker.estimation.tracking.confidence import Status
from tracker.estimation.tracking.tracker import PoseEstimate, TrackingRun
from tracker.estimation.voxel.assessment import assess, unexplained_voxels
from tracker.estimation.voxel.body_pose import pose_of, state_of
from tracker.estimation.voxel.figure import N_PARTS, figure_of, part_rotations
from tracker.estimation.voxel.frame_voxels import FrameVoxels, carve_around
from tracker.estimation.voxel.kalman import LinearizedMeasurement, Update, joined, update
from tracker.estimation.voxel.labels import Labels, label_voxels
from tracker.estimation.voxel.measurement import linearize, linearize_rotations, measure_parts
from tracker.estimation.voxel.motion_model import predict
from tracker.estimation.voxel.resolved_parts import ResolvedParts, carried, find_resolved_parts, measure_together
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.estimation.voxel.state import FilterState
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.geometry.arrays import Array

_PATIENCE = 8
"""Number of frames in a row on which parts are merged before they are measured on a coarser level."""
_CARRIED_RAD = 0.2
"""Standard deviation with which an unresolved part keeps its place on another, rad."""


class VoxelEstimator:
    """The filters of all people of a run, in the order of its frames."""

    def __init__(self, run: TrackingRun, settings: VoxelSettings) -> None:
        """Begin at the start poses.

        Args:
            run: what to track.
            settings: of the tracker.

        Raises:
            TrackerError: a body has not the joints of ten parts.
        """
        self._run, self._settings = run, settings
        self._frame: int | None = None
        step = abs(run.frames[1] - run.frames[0]) if len(run.frames) > 1 else 1
        self._dt = step / run.fps
        starts = [np.atleast_2d(np.asarray(s)) for s in run.start]
        self._poses = [s[-1] for s in starts]
        self.states = [
            state_of(m, list(s), self._dt, settings) for m, s in zip(run.subjects.models, starts, strict=True)
        ]
        self._near: dict[int, Array] = {}  # poses close to those of the frame, where the fits of poses start
        self._has_motion = [len(s) > 1 for s in starts]
        self._levels = [ResolvedParts.finest()] * len(starts)
        self._lost_limbs = [frozenset[str]()] * len(starts)
        self.labels: Labels | None = None
        self.voxels: FrameVoxels | None = None

    def estimate(self, frame: int, silhouettes: Sequence[ViewSilhouette]) -> PoseEstimate:
        """Return the poses of all people on the next frame.

        Args:
            frame: its number.
            silhouettes: of all views.
        """
        subjects, settings = self._run.subjects, self._settings
        keyframes = subjects.keyframes_at(frame)
        states = [self._predicted(p, frame, keyframes.get(p)) for p in range(len(self.states))]
        first, self._frame = self._frame is None, frame
        found = carve_around(silhouettes, states, settings.voxel_m)
        points = found.voxels.points_world
        updates: dict[int, Update] = {}
        for p in subjects.tracked:
            if p not in keyframes:
                updates[p] = self._adjusted(p, states, found) if first else self._update(p, states, points, first)
                states[p] = self._constrained(p, updates[p].state)
        self.states, self.voxels = states, found
        self.labels = label_voxels(points, states, settings.voxel_m, settings.label_rule)
        if settings.levels:
            for p in updates:
                self._find_levels(p, states[p], found, self.labels, _PATIENCE)
        return self._estimate(frame, found, updates)

    def _adjusted(self, p: int, states: list[FilterState], found: FrameVoxels) -> Update:
        """Return the adjustment of a person in the first frame, with the levels that its result shows."""
        points = found.voxels.points_world
        result = self._update(p, states, points, True)
        if not self._settings.levels:
            return result
        labels = label_voxels(
            points, [*states[:p], result.state, *states[p + 1 :]], self._settings.voxel_m, self._settings.label_rule
        )
        self._find_levels(p, result.state, found, labels, 1)
        return result if self._levels[p].is_resolved.all() else self._update(p, states, points, True)

    def _constrained(self, p: int, state: FilterState) -> FilterState:
        """Return an updated state within the limits of the body, with unresolved parts carried along."""
        if self._settings.sizes == "first" and state.layout.sizes:
            state = state.with_frozen_sizes()
        if not self._levels[p].is_resolved.all():
            state = self._carried(p, state)
        return state if self._settings.limit_rad is None else self._within_limits(p, state)

    def _find_levels(self, p: int, state: FilterState, found: FrameVoxels, labels: Labels, patience: int) -> None:
        self._levels[p] = find_resolved_parts(
            self._levels[p], state, found.voxels, labels.labels, N_PARTS * p, patience
        )

    def _predicted(self, p: int, frame: int, keyframe: Array | None) -> FilterState:
        model, state = self._run.subjects.models[p], self.states[p]
        dt = self._dt if self._frame is None else abs(frame - self._frame) / self._run.fps
        if keyframe is not None:
            past = [self._poses[p], keyframe] if self._frame is not None else [keyframe]
            self._poses[p] = keyframe
            return state_of(model, past, dt, self._settings)
        if p not in self._run.subjects.tracked or (self._frame is None and not self._has_motion[p]):
            return state  # the model is adjusted in the first frame with the identity as transition
        return predict(state, dt, self._settings.process)

    def _update(self, p: int, states: Sequence[FilterState], points: Array, first: bool) -> Update:
        settings = self._settings
        others = list(states)

        def measure(state: FilterState) -> LinearizedMeasurement | None:
            others[p] = state
            clouds = label_voxels(points, others, settings.voxel_m, settings.label_rule).clouds.of_person(p)
            parts = measure_parts(state, clouds, settings.voxel_m, settings.by_size)
            levels = self._levels[p]
            return joined(
                linearize(state, parts, settings.measurement, levels.is_resolved, state.layout.sizes),
                measure_together(state, clouds, levels.pairs, settings.measurement.across_m),
            )

        return update(states[p], measure, settings.start_iterations if first else settings.iterations)

    def _carried(self, p: int, state: FilterState) -> FilterState:
        """Return the state in which unresolved parts keep their place on the part that they hang on."""
        rotations = carried(self.states[p], state, self._levels[p])
        return update(state, lambda s: linearize_rotations(s, rotations, _CARRIED_RAD)).state

    def _within_limits(self, p: int, state: FilterState) -> FilterState:
        """Return the state drawn to the closest pose of the body, whose joints have limits and fewer axes."""
        model, sigma = self._run.subjects.models[p], self._settings.limit_rad
        assert sigma is not None
        self._near[p] = pose_of(model, state, self._poses[p], self._run.subjects.active_dofs[p]).values
        allowed = part_rotations(PosedBody(model, self._near[p]), figure_of(model))
        return update(state, lambda s: linearize_rotations(s, allowed, sigma)).state

    def _estimate(self, frame: int, found: FrameVoxels, updates: dict[int, Update]) -> PoseEstimate:
        subjects = self._run.subjects
        n_views = len(self._run.observer.cameras)
        free = unexplained_voxels(found.voxels, self.states)
        poses, statuses, notes, covariances = list(self._poses), list[Status](), list[str](), list[Array]()
        for p, model in enumerate(subjects.models):
            if p not in updates:
                statuses.append("good")
                notes.append("")
                covariances.append(np.zeros((model.n_dofs, model.n_dofs)))
                continue
            state = self.states[p]
            body = pose_of(model, state, poses[p], subjects.active_dofs[p], self._near.get(p))
            poses[p] = body.values
            per_row = updates[p].normalized_innovation / max(1, updates[p].n_rows)
            verdict = assess(state, found, free[p], per_row, self._levels[p].notes, self._lost_limbs[p])
            self._lost_limbs[p] = verdict.lost_limbs
            statuses.append(verdict.status)
            notes.append(verdict.note)
            covariances.append(body.covariance)
        self._poses = poses
        if "lost" in statuses:  # whose voxels are labelled as those of the others
            for p, status in enumerate(statuses):
                if status == "good" and p in updates:
                    statuses[p], notes[p] = "doubtful", "another person is lost: their voxels cannot be separated"
        hidden = tuple(np.full(len(m.parts), np.nan) for m in subjects.models)
        return PoseEstimate(
            frame, tuple(poses), float("nan"), np.full(n_views, np.nan), 0, tuple(statuses), tuple(notes), hidden,
            tuple(covariances), (None,) * len(poses), ((),) * len(poses), self._settings.method,
        )  # fmt: skip
