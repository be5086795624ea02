"""Track people forward through the frames of a run: predict, observe, estimate, remember."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import PredictSettings, shortest_step
from tracker.compute.threads import map_parallel
from tracker.estimation.by_frame.assessment import PersonEstimate
from tracker.estimation.by_frame.frame_estimator import FrameEstimator
from tracker.estimation.by_frame.frame_problem import Bodies
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.by_frame.start_pose import SearchedStart, StartFrame, settle_starts
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.estimation.tracking.confidence import Status
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.estimation.tracking.tracker import AlternativePose, PoseEstimate, TrackingRun
from tracker.estimation.tracking.view_regions import confirmed_regions, regions
from tracker.evidence.contours.occluding_contours import Contour, trace_views
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import Region

_Predict = Callable[[PersonMemory, PredictSettings], Array]
"""Predicts a pose, (n_values,)."""


def track_forward(
    run: TrackingRun, settings: EstimationSettings, make_estimator: type[FrameEstimator] = FrameEstimator
) -> Iterator[PoseEstimate]:
    """Track all people frame by frame, in the order of `run.frames`.

    Args:
        run: what to track.
        settings: of the tracker.
        make_estimator: estimates a frame by the tracker's method.

    Yields:
        The poses of each frame.
    """
    way = _ForwardPass(run, settings, make_estimator)
    for i in range(len(run.frames)):
        yield way.collected(way.advance(i))


class _Found(NamedTuple):
    """A frame that was estimated and learnt from, before the estimates of all people are collected."""

    frame: int
    estimator: FrameEstimator
    estimates: Mapping[int, PersonEstimate]
    """Of the people who have no fixed pose."""
    starts: Mapping[int, SearchedStart]
    """Searches of the poses that the run began with, by person."""
    cost_of: ChamferCost
    """Around the estimated poses."""


class _Seen(NamedTuple):
    """All people on a frame before they are refined, and the evidence around them."""

    bodies: Bodies
    contours: list[Contour]
    """Of all people in each view."""
    views: tuple[ViewEvidence, ...]


class _ForwardPass:
    """The state of a run from frame to frame."""

    def __init__(self, run: TrackingRun, settings: EstimationSettings, make_estimator: type[FrameEstimator]) -> None:
        """Begin before the first frame; see `track_forward`."""
        self._run, self._settings, self._make_estimator = run, settings, make_estimator
        self._memories = [self._memory(p, start) for p, start in enumerate(run.start)]
        cameras, self._learns_static = run.observer.working_cameras, settings.segments and settings.edges.static
        self._static_edges = [StaticEdgeModel(c.size) for c in cameras] if self._learns_static else None
        self._regions = _Regions(run, settings.edges.whole_images)

    def advance(self, i: int) -> _Found:
        """Estimate the ith frame of the run, and learn from it.

        Args:
            i: the frames before it have been estimated.
        """
        run, settings, subjects, frame = self._run, self._settings, self._run.subjects, self._run.frames[i]
        if i == 0:
            self._read_first(frame)
        predicted = _moving(run, self._memories, self._placed(frame, PersonMemory.predict), i)
        where, following = self._regions.around(predicted), run.frames[i + 1 : i + 2]
        for k in following if self._regions.is_ahead else ():
            self._regions.look_ahead(self._placed(k, PersonMemory.predict_two_ahead))
            self._read_ahead(k)
        seen = self._observe(frame, predicted, where)
        seen, starts = self._settled(seen) if i == 0 else (seen, {})
        for k in () if self._regions.is_ahead else following:  # for one person now: this frame has kept all cores busy
            run.observer.prefetch(k)
        estimator = self._make_estimator(seen.views, self._memories, seen.bodies, settings, seen.contours)
        fixed, people = subjects.keyframes_at(frame), range(len(subjects.models))
        estimates = estimator.estimate([p for p in subjects.tracked if p not in fixed])
        statuses: list[Status] = [estimates[p].status if p in estimates else "good" for p in people]
        cost_of = self._learn(fixed, estimator, seen.views, statuses, starts)
        return _Found(frame, estimator, estimates, starts, cost_of)

    def collected(self, found: _Found) -> PoseEstimate:
        """Collect the estimates of all people of a frame."""
        frame, estimator, estimates, starts, cost_of = found
        people = [estimates[p] if p in estimates else estimator.estimate_fixed(p) for p in range(len(estimator.bodies))]
        people = [e.after(starts[p].trace) if p in starts else e for p, e in enumerate(people)]
        return make_estimate(frame, cost_of, estimator.bodies, people, self._settings)

    def _memory(self, person: int, start: Array | Sequence[Array]) -> PersonMemory:
        """Return the state of a person who begins in some poses."""
        subjects, is_alone = self._run.subjects, len(self._run.subjects.models) == 1
        model, active = subjects.models[person], subjects.active_dofs[person]
        return PersonMemory(model, start, active, is_alone)

    def _placed(self, frame: int, predict: _Predict) -> Bodies:
        """Return all people on a frame: in their keyframes, as predicted, or where they stay if not tracked."""
        subjects, settings = self._run.subjects, self._settings.predict
        keyframes = subjects.keyframes_at(frame)
        poses = [
            keyframes.get(p, predict(m, settings) if p in subjects.tracked else m.history[-1])
            for p, m in enumerate(self._memories)
        ]
        return tuple(PosedBody(m, v) for m, v in zip(subjects.models, poses, strict=True))

    def _read_first(self, frame: int) -> None:
        """Read the first frame. A run that goes on from known poses uses the regions of one without a break."""
        goes_on = len(self._memories) > 1 and all(len(m.history) > 1 for m in self._memories)
        if goes_on:
            self._regions.look_ahead(self._placed(frame, PersonMemory.predict_before_last))
        self._read_ahead(frame)

    def _read_ahead(self, frame: int) -> None:
        self._run.observer.prefetch(frame, self._regions.ahead or None, self._learns_static, self._settings.edges)

    def _observe(self, frame: int, bodies: Bodies, where: Sequence[Region | None]) -> _Seen:
        """Trace the contours of all people in each view, and compute the evidence around them."""
        observer, settings = self._run.observer, self._settings
        contours = trace_views(bodies, observer.working_cameras, observer.ahead_frames(frame))
        visible = [c.pieces_px[~c.occluded] for c in contours] if settings.segments else None
        return _Seen(bodies, contours, observer.evidence(frame, where, visible, self._static_edges, settings.edges))

    def _settled(self, seen: _Seen) -> tuple[_Seen, dict[int, SearchedStart]]:
        """Search the poses that the run begins with, where the first frame contradicts them; return what is seen from
        there, and the searches by person."""
        frame, fixed = self._run.frames[0], self._run.subjects.keyframes_at(self._run.frames[0])
        begun = StartFrame(*seen, lambda bodies: self._observe(frame, bodies, self._regions.new(bodies)).views)
        starts = settle_starts(begun, self._memories, self._run.subjects.tracked, self._settings)
        settled = {p: s.body for p, s in starts.items() if s.taken}
        for p, body in settled.items():
            self._memories[p] = self._memory(p, body.values)
        if not settled.keys() <= fixed.keys():
            bodies = tuple(b if p in fixed else settled.get(p, b) for p, b in enumerate(seen.bodies))
            seen = self._observe(frame, bodies, self._regions.new(bodies))
        return seen, starts

    def _learn(
        self, keyframes: Mapping[int, Array], estimator: FrameEstimator, views: Sequence[ViewEvidence],
        statuses: Sequence[Status], starts: Mapping[int, SearchedStart],
    ) -> ChamferCost:  # fmt: skip
        """Learn from the poses of a frame, and return the cost around its estimates.

        If a frame contradicts its keyframe, colours are learnt from the settled pose.
        """
        settled = {p: starts[p].body for p in starts if starts[p].taken and p in keyframes}
        learnt = tuple(settled.get(p, b) for p, b in enumerate(estimator.bodies))
        _remember(self._memories, estimator, learnt, statuses, keyframes)
        settings = self._settings
        cost_of = ChamferCost(views, estimator.bodies, settings.theta_px, settings.outliers)
        if self._static_edges is not None:
            there = cost_of
            if learnt != estimator.bodies:
                there = ChamferCost(views, learnt, settings.theta_px, settings.outliers)
            update_static_edges(self._static_edges, views, there.predicted_pieces_px)
        return cost_of


class _Regions:
    """Chooses the regions of each frame, a frame ahead for several people."""

    def __init__(self, run: TrackingRun, whole_images: bool) -> None:
        self._cameras = run.observer.working_cameras
        self._whole: list[Region | None] | None = [None] * len(self._cameras) if whole_images else None
        self.is_ahead = len(run.subjects.models) > 1
        self.ahead: list[Region | None] = []
        """Regions of the frame that is read ahead."""

    def look_ahead(self, predicted: Bodies) -> None:
        """Choose the regions of a frame that is read ahead, around all bodies as predicted two frames on."""
        self.ahead = self.new(predicted)

    def around(self, bodies: Bodies) -> list[Region | None]:
        """Return the regions that were chosen ahead, where they hold all bodies; else new ones."""
        if self.ahead and self._whole is None:
            return confirmed_regions(self.ahead, self._cameras, bodies)
        return self.new(bodies)

    def new(self, bodies: Bodies) -> list[Region | None]:
        """Return regions around all bodies."""
        return self._whole or regions(self._cameras, bodies)


def _moving(run: TrackingRun, memories: Sequence[PersonMemory], bodies: Bodies, i: int) -> Bodies:
    """Return all people on the ith frame of a run with their velocities, if a view needs them.

    The memories take in by how many frames the frame follows the last poses.
    """
    if not any(run.observer.ahead_frames(run.frames[i])):
        return bodies
    frames, out = run.frames, []
    first, second = (frames[i - 1], frames[i]) if i > 0 else (frames[0], frames[min(1, len(frames) - 1)])
    for memory, body in zip(memories, bodies, strict=True):
        memory.step_frames = (second - first) or 1
        velocity = shortest_step(body.model, body.values, memory.history[-1]) / memory.step_frames
        out.append(PosedBody(body.model, body.values, velocity))
    return tuple(out)


def make_estimate(
    frame: int,
    cost_of: ChamferCost,
    bodies: Sequence[PosedBody],
    people: Sequence[PersonEstimate],
    settings: EstimationSettings,
) -> PoseEstimate:
    """Collect the estimates of all people of a frame.

    Args:
        frame: its number.
        cost_of: the cost function around the estimated poses.
        bodies: all people in these poses.
        people: the estimate of each person.
        settings: of the tracker.
    """
    cost = cost_of.at_prediction()
    alternatives = tuple(
        tuple(AlternativePose(poses[p], cost_of(poses).total_px) for poses in e.alternatives)
        for p, e in enumerate(people)
    )
    return PoseEstimate(
        frame, tuple(b.values for b in bodies), cost.total_px, cost.view_costs_px, sum(e.evaluations for e in people),
        tuple(e.status for e in people), tuple(e.note for e in people), tuple(e.part_costs_px for e in people),
        tuple(e.covariance for e in people), tuple(e.quality for e in people), alternatives, settings.method,
        tuple(e.normal_matrix for e in people), tuple(e.trace for e in people),
    )  # fmt: skip


def _remember(
    memories: Sequence[PersonMemory], estimator: FrameEstimator, bodies: Bodies, statuses: Sequence[Status],
    keyframes: Mapping[int, Array],
) -> None:  # fmt: skip
    """Update the memory of each person with the result of a frame: all people in some poses."""

    def remember(p: int) -> None:
        memories[p].update(bodies[p].values, estimator.problem.colors(p, bodies), statuses[p], keyframe=p in keyframes)

    map_parallel(remember, range(len(memories)))


def update_static_edges(
    static_edges: Sequence[StaticEdgeModel], views: Sequence[ViewEvidence], visible: Sequence[FloatArray]
) -> None:
    """Learn the edges away from all people, in views where no silhouette tells people from the background.

    Args:
        static_edges: of each view.
        views: the evidence of the frame.
        visible: visible contours of all people in each view, x0, y0, x1, y1, (M, 4), px of the region.
    """
    for view, model, pieces in zip(views, static_edges, visible, strict=True):
        if view.segments is not None and view.silhouette is None:
            model.update(view.segments, view.corner_px, view.camera.size, pieces, ACCEPTED_SHARE * view.theta_px)
