"""The chamfer tracker of GD96: predict, observe, estimate, judge, one frame at a time.

The prediction is first refined on the edges around it (`refine`). Only where the outcome is not credible
(`confidence`) the best-first search of the paper is spent, on the whole body, and proposals on single limbs
(`recover`); the cheapest refined pose wins.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker import confidence, contours
from tracker.apart import KeepApart
from tracker.appearance import Colors, PartColors
from tracker.body import Body, BodyModel
from tracker.cameras import Camera
from tracker.chamfer import ChamferCost, Outliers
from tracker.confidence import Limb, Quality, Status
from tracker.contours import FloatArray
from tracker.evidence import ACCEPTED_SHARE, Observer, ViewEvidence, unfiltered
from tracker.fit import Block, Fit, StayNear, covariance, held, solve
from tracker.matched import region_around
from tracker.predict import PredictSettings, predict
from tracker.recover import Judge, RecoverSettings, search_limbs
from tracker.refine import WORTH_A_STEP, ContourMatch, MatchSettings, PartCosts
from tracker.rigid import Array
from tracker.scenery import Scenery
from tracker.search import BEFORE_REFINEMENT, SearchSettings, SearchStep, search

Estimation = Literal["refine", "search"]

_ITERATIONS = 15
_TOLERANCE = 1e-3  # rad or metres: a tenth of a pixel on a limb
_LONGEST_PAUSE = 8
"""A limb that seems lost and is not found is searched at least every so many frames."""
_LEARN_FRAMES, _TRACKED_SHARE, _GIVEN_SHARE = 3, 0.15, 0.5
"""Every so many frames the colours of the parts are brought up to date, and what such a frame counts; what a keyframe
counts against the frames before it."""
_AT_ONCE = 2
"""Limbs that are searched in a frame at most, the likeliest to be lost first; the others come in the next frames."""
_MOVED_RAD, _ANEW_RAD = 0.05, 0.3
"""A search of a limb was not in vain where a joint turned farther; the limb is elsewhere where it turned this far."""
_NEAREST_M = 0.3
"""Bodies nearer to a camera, and those behind it, count as this near."""
_REGION_MARGIN_M = 0.22
"""What is added around the joints to the region that is looked at: the flesh, and what the prediction may be off."""


@dataclass(frozen=True)
class TrackSettings:
    """What the chamfer tracker is told."""

    estimate: Estimation = "refine"
    """`refine` searches only where refinement does not suffice; `search` is best-first search alone, as in GD96."""
    predict: PredictSettings = field(default_factory=PredictSettings)
    """Motion model."""
    match: MatchSettings = field(default_factory=MatchSettings)
    """How contours and edges pull in the refinement."""
    search: SearchSettings = field(default_factory=SearchSettings)
    """Bounds, steps and stopping rule of the best-first search."""
    recover: RecoverSettings | None = field(default_factory=RecoverSettings)
    """How lost limbs are searched for; None leaves them."""
    theta_px: float | None = None
    """Outlier distance, px of the footage; None for 3% of the longer side of each image."""
    outliers: Outliers = "truncated"
    """How the search treats outliers, see `ChamferCost`."""
    segments: bool = True
    """Whether edges count only in segments that the prediction accepts as wholes (GD96 Sect. 4.2), and never those
    that stand still away from everybody."""
    trust_rad: float = 0.15
    """Standard deviation of the prediction of an angle, rad."""
    trust_m: float = 0.05
    """Standard deviation of the prediction of a position, metres."""


class PoseEstimate(NamedTuple):
    """Poses found on one frame."""

    frame: int
    poses: tuple[Array, ...]
    """Pose of each person, (n_values,) each."""
    cost_px: float
    """Cost of the poses against all edges near them, px of the footage."""
    views_px: Array
    """The same for each view, (V,); NaN for a view without edges."""
    evaluations: int
    """Poses that the best-first search scored to find them."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""
    remarks: tuple[str, ...]
    """What was out of the ordinary with each person; empty where nothing was."""
    parts_px: tuple[Array, ...]
    """Mean distance of the contour of each person's parts to the edges, (n_parts,) each, px; NaN where hidden."""
    covariances: tuple[Array, ...]
    """Covariance of each pose, (n_dofs, n_dofs) each, rad and metres; of a pose that was given, zero."""
    qualities: tuple[Quality | None, ...]
    """What the statuses were judged by; None for a pose that was given."""


def pose_cost(
    views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array], settings: TrackSettings
) -> ChamferCost:
    """Make the cost function around given poses: what a search from them minimizes."""
    bodies = [Body(m, p) for m, p in zip(models, poses, strict=True)]
    return ChamferCost(views, bodies, settings.theta_px, settings.outliers)


def search_frame(
    views: Sequence[ViewEvidence],
    models: Sequence[BodyModel],
    predicted: Sequence[Array],
    settings: TrackSettings,
    people: Sequence[int] | None = None,
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[SearchStep]:
    """Search the poses of one frame from their prediction, step by step; see `search`."""
    cost = pose_cost(views, models, predicted, settings)
    return search(cost, predicted, settings.search, people, free)


def prior_blocks(model: BodyModel, expected: Array, sigmas: Array) -> list[Block]:
    """What holds a pose besides the image: the one that is expected, how people bend, and that flesh keeps apart.

    Args:
        model: the body.
        expected: the pose, (n_values,).
        sigmas: its standard deviations, (n_dofs,), rad or metres.
    """
    return [StayNear(expected, 1 / sigmas), StayNear(model.neutral(), 1 / model.spreads), KeepApart()]


def track_chamfer(
    observer: Observer,
    models: Sequence[BodyModel],
    start: Sequence[Array | Sequence[Array]],
    frames: Sequence[int],
    settings: TrackSettings,
    fixed: Mapping[int, Mapping[int, Array]] | None = None,
    people: Sequence[int] | None = None,
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[PoseEstimate]:
    """Track all people frame by frame.

    Args:
        observer: gives the evidence of a frame.
        models: the body of each person.
        start: of each person the pose from which the first frame is predicted, (n_values,), or the poses of the frames
            before it, the last one last, (n, n_values).
        frames: the frames in the order of tracking.
        settings: of the tracker.
        fixed: poses that stay as they are (keyframes), by frame and person; tracking goes on from them.
        people: whom to track; everybody by default. The others stand as they are in `start` or `fixed`.
        free: of each person the degrees of freedom that may move, (n_dofs,); all by default. The others stay as they
            are in `start`, or in the last of `fixed`.

    Yields:
        The poses of each frame.
    """
    everybody = tuple(range(len(models))) if people is None else tuple(people)
    masks = [None] * len(models) if free is None else list(free)
    tracks = [_Track(m, s, mask) for m, s, mask in zip(models, start, masks, strict=True)]
    scenery = [Scenery(c.size) for c in observer.matched_cameras] if settings.segments else None
    for i, frame in enumerate(frames):
        for ahead in frames[i : i + 2]:
            observer.prefetch(ahead)
        given = (fixed or {}).get(frame, {})
        poses = [given.get(p, t.expected(settings) if p in everybody else t.past[-1]) for p, t in enumerate(tracks)]
        regions, bodies = _regions(observer, models, poses), [Body(m, p) for m, p in zip(models, poses, strict=True)]
        outlines = [_outline(bodies, c) for c in observer.matched_cameras] if settings.segments else None
        views = observer.evidence(frame, regions, outlines, scenery)
        scene = _Scene(views, list(models), poses, settings)
        found = [
            scene.held(p, tracks[p]) if p in given or p not in everybody else scene.estimate(p, tracks[p])
            for p in range(len(models))
        ]
        for p, (track, pose) in enumerate(zip(tracks, found, strict=True)):
            track.update(scene, p, pose, given=p in given)
        if scenery is not None:
            scene.teach(scenery)
        cost = pose_cost(views, models, scene.poses, settings)(scene.poses)
        yield PoseEstimate(
            frame, tuple(scene.poses), cost.total_px, cost.views_px, sum(f.evaluations for f in found),
            tuple(f.status for f in found), tuple(f.remark for f in found), tuple(f.parts_px for f in found),
            tuple(f.covariance for f in found), tuple(f.quality for f in found),
        )  # fmt: skip


class _Found(NamedTuple):
    """One person on one frame."""

    status: Status
    remark: str
    parts_px: Array
    covariance: Array
    evaluations: int
    quality: Quality | None


class _Track:
    """What is remembered of one person from frame to frame."""

    def __init__(self, model: BodyModel, start: Array | Sequence[Array], free: NDArray[np.bool_] | None = None) -> None:
        self.model, self.free = model, free
        moving = np.ones(model.n_dofs, dtype=bool) if free is None else free
        limbs = [limb._replace(dofs=limb.dofs & moving) for limb in confidence.limbs(model)]
        self.limbs = [limb for limb in limbs if limb.dofs.any()]  # those that may be searched, by what may move
        self.past = list(np.atleast_2d(np.array(start)))
        self.last_good = self.past[-1]
        self.known: PartColors | None = None
        self._frames = 0
        self._pauses: dict[str, tuple[int, int]] = {}  # per limb: when it may be searched again, and the last pause

    def expected(self, settings: TrackSettings) -> Array:
        """The predicted pose of the next frame."""
        return held(self.model, predict(self.model, self.past, settings.predict), self.past[-1], self.free)

    def may_search(self, limb: Limb) -> bool:
        """Whether a limb is due: one that was searched in vain waits longer each time."""
        return self._frames >= self._pauses.get(limb.name, (0, 0))[0]

    def searched(self, limb: Limb, found: bool) -> None:
        """Note how the search for a limb went."""
        pause = 0 if found else min(_LONGEST_PAUSE, 2 * self._pauses.get(limb.name, (0, 0))[1] + 1)
        self._pauses[limb.name] = (self._frames + pause + 1, pause)

    def update(self, scene: "_Scene", person: int, found: _Found, given: bool) -> None:
        """Take in what a frame brought."""
        pose = scene.poses[person]
        self._frames += 1
        if self.known is None or given:
            self.known = scene.colors(person).learn(self.known, _GIVEN_SHARE)
        elif self._frames % _LEARN_FRAMES == 0 and found.status != "lost":
            self.known = scene.colors(person).learn(self.known, _TRACKED_SHARE)
        self.past = [*self.past[-7:], pose]
        if found.status == "good":
            self.last_good = pose


class _Scene:
    """One frame: its evidence, and where everybody stands so far."""

    def __init__(
        self, views: Sequence[ViewEvidence], models: list[BodyModel], poses: list[Array], settings: TrackSettings
    ) -> None:
        self.views, self.models, self.poses, self.settings = list(views), models, poses, settings
        self._thetas = np.array([v.outlier_px(settings.theta_px) for v in views])

    def teach(self, scenery: Sequence[Scenery]) -> None:
        """Show what remembers the room the edges away from everybody, of views whose silhouette nothing tells."""
        for view, room in zip(self.views, scenery, strict=True):
            if view.segments is not None and view.silhouette is None:
                pieces = _outline(self._bodies(), view.camera)
                room.learn(view.segments, view.corner_px, view.camera.size, pieces, ACCEPTED_SHARE * view.theta_px)

    def colors(self, person: int) -> Colors:
        """The colours of this frame under a person."""
        return Colors(self.views, self._bodies(), person)

    def held(self, person: int, track: _Track) -> _Found:
        """Judge nobody: a pose that was given is taken as it is."""
        match = ContourMatch(self.views, self._bodies(), person, self.settings.match, self.settings.theta_px)
        n = track.model.n_dofs
        return _Found("good", "", self._parts_px(match.part_costs(self.poses[person])), np.zeros((n, n)), 0, None)

    def estimate(self, person: int, track: _Track) -> _Found:
        """Find the pose of one person, the others as they stand; it takes its place in `poses`."""
        model, settings, predicted = track.model, self.settings, self.poses[person]
        match = ContourMatch(self.views, self._bodies(), person, settings.match, settings.theta_px)
        blocks: list[Block] = [match, *self._priors(model, predicted, [])]
        if settings.estimate == "search":
            evaluations = self._search(person, track, settings.search)
            fit = solve(model, self.poses[person], blocks, track.free, max_iterations=0)
            costs = match.part_costs(fit.values)
            found = self._quality(person, track, costs, fit)
            return self._take(person, costs, fit, found, evaluations, [])
        fit = solve(model, predicted, blocks, track.free, _ITERATIONS, _TOLERANCE)
        costs = match.part_costs(fit.values)
        found = self._quality(person, track, costs, fit)
        blind = not any(len(v.points_px) for v in self.views)  # then there is nothing to search in
        if settings.recover is None or blind or not (found.suspects or found.body_lost):
            return self._take(person, costs, fit, found, 0, [])
        return self._recover(person, track, fit, found, predicted)

    def _recover(self, person: int, track: _Track, fit: Fit, found: Quality, predicted: Array) -> _Found:
        """Search what the refinement alone did not find, among all edges: the prediction may refuse the right ones."""
        model, settings = track.model, self.settings
        assert settings.recover is not None
        suspects = [x for name in found.suspects for x in track.limbs if x.name == name]  # not those that are locked
        priors = self._priors(model, predicted, suspects)
        self.views = [unfiltered(v) for v in self.views]
        match = ContourMatch(self.views, self._bodies(), person, settings.match, settings.theta_px, everywhere=True)
        judge = Judge(match, priors, self.colors(person), track.known, settings.recover, track.free)
        fit = solve(model, fit.values, [match, *priors], track.free, _ITERATIONS, _TOLERANCE, gain=WORTH_A_STEP)
        remarks: list[str] = []
        evaluations = 0
        if found.body_lost:
            evaluations, fit = self._search_body(person, track, fit, judge)
            remarks.append("body searched anew")
        due = [x for x in suspects if track.may_search(x)][:_AT_ONCE]
        better = search_limbs(model, due, fit, (track.past[-1], predicted), judge, _ITERATIONS)
        turned = np.abs(model.difference(better.values, fit.values))
        for limb in due:
            track.searched(limb, found=turned[limb.dofs].max() > _MOVED_RAD)
            if turned[limb.dofs].max() > _ANEW_RAD:
                remarks.append(f"{confidence.spoken(limb.name)} searched anew")
        fit = better
        costs = match.part_costs(fit.values)
        found = self._quality(person, track, costs, fit)
        return self._take(person, costs, fit, found, evaluations, remarks)

    def _take(
        self, person: int, costs: PartCosts, fit: Fit, found: Quality, evaluations: int, remarks: list[str]
    ) -> _Found:
        """Put a person in the pose that was found, with the judgement of it."""
        self.poses[person] = fit.values
        return _Found(
            confidence.judge(found), ", ".join(remarks) or confidence.reason(found), self._parts_px(costs),
            covariance(self.models[person], fit), evaluations, found,
        )  # fmt: skip

    def _priors(self, model: BodyModel, predicted: Array, suspects: Sequence[Limb]) -> list[Block]:
        """What holds a pose besides the image: its prediction, but for limbs that seem lost, and how people bend."""
        settings = self.settings
        sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)
        for limb in suspects:
            assert settings.recover is not None
            sigma[limb.dofs] = settings.recover.trust_rad
        return prior_blocks(model, predicted, sigma)

    def _search_body(self, person: int, track: _Track, fit: Fit, judge: Judge) -> tuple[int, Fit]:
        """Best-first search from the prediction and from the last good pose; the best of what refines from there."""
        predicted, best, evaluations = self.poses[person], fit, 0
        for start in (predicted, track.last_good):
            self.poses[person] = held(track.model, start, predicted, track.free)
            evaluations += self._search(person, track, BEFORE_REFINEMENT)
            blocks, here = [judge.match, *judge.priors], self.poses[person]
            refined = solve(track.model, here, blocks, track.free, _ITERATIONS, _TOLERANCE, gain=WORTH_A_STEP)
            if judge.cost(refined) < judge.cost(best):
                best = refined
        self.poses[person] = best.values
        return evaluations, best

    def _search(self, person: int, track: _Track, how: SearchSettings) -> int:
        """Best-first search of one person from where it stands; returns how many poses were scored."""
        evaluations, start = 0, self.poses[person]
        settings = replace(self.settings, search=how)
        free = None if track.free is None else [track.free] * len(self.models)  # only that of the person counts
        for step in search_frame(self.views, self.models, self.poses, settings, [person], free):
            self.poses, evaluations = list(step.best), step.evaluations
        self.poses[person] = held(track.model, self.poses[person], start, track.free)
        return evaluations

    def _quality(self, person: int, track: _Track, costs: PartCosts, fit: Fit) -> Quality:
        known, colors = track.known, None
        if known is not None:
            colors = self.colors(person).score(fit.values, known), known
        trusts = np.array([0.0 if v.silhouette is None else v.silhouette.trust for v in self.views])
        return confidence.quality(
            track.model, fit, costs, self._thetas, trusts, _px_per_m(self.views, track.model, fit.values), colors
        )

    def _parts_px(self, costs: PartCosts) -> Array:
        """Mean distance of each part's contour to the edges, (n_parts,), px of the footage."""
        scales = np.array([v.scale for v in self.views])
        length = (costs.length_px / scales[:, None]).sum(axis=0)
        far = np.nansum(costs.forward_px * costs.length_px / scales[:, None] ** 2, axis=0)
        return np.divide(far, length, out=np.full_like(length, np.nan), where=length > 0)

    def _bodies(self) -> list[Body]:
        return [Body(m, p) for m, p in zip(self.models, self.poses, strict=True)]


def _px_per_m(views: Sequence[ViewEvidence], model: BodyModel, values: Array) -> float:
    """Length of a metre where a body stands, in the view that shows it in between the largest and the smallest."""
    middle = model.points_world(values).mean(axis=0)
    return float(np.median([v.camera.K[0, 0] / max(v.camera.depths(middle), _NEAREST_M) for v in views]))


def _outline(bodies: Sequence[Body], camera: Camera) -> FloatArray:
    """Visible pieces of the predicted contours, x0, y0, x1, y1, (M, 4), px."""
    contour = contours.trace(bodies, camera)
    return contour.pieces_px[~contour.hidden]


def _regions(
    observer: Observer, models: Sequence[BodyModel], poses: Sequence[Array]
) -> list[tuple[int, int, int, int] | None]:
    """Where to look in each view: around everybody, as predicted."""
    points = np.concatenate([m.points_world(p) for m, p in zip(models, poses, strict=True)])
    out: list[tuple[int, int, int, int] | None] = []
    for camera in observer.matched_cameras:
        depths = camera.depths(points)
        if depths.min() < 2 * _REGION_MARGIN_M:  # too near for its outline to lie around the joints' images
            out.append(None)
            continue
        margin = _REGION_MARGIN_M * camera.K[0, 0] / float(np.median(depths))
        out.append(region_around(camera.project(points), margin, camera.size))
    return out
