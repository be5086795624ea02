"""Acquire a person's body from the contours of a recording (GD96 Sect. 3), over several frames and all views at once.

GD96 fits each part to its contours in a frontal and a side view. Here all parts, joints and poses are fitted together,
so that any poses will do and joints are found where the flesh turns about them.

Choose the frames from which the sizes of a body are acquired: those whose poses show the unknown sizes best.

The contours of a frame carry information about the sizes, whatever the pose is: the Schur complement of their normal
matrix. Frames are added one at a time, each the one that shrinks the uncertainty of all sizes most (the determinant of
their covariance, D-optimality; e.g. Fedorov 1972).
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.body.motion.pose_steps import moving_bodies
from tracker.compute.progress import Report, stages, unreported
from tracker.compute.sampling import spread_indices
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_voxels import (
    SilhouettedPerson,
    VoxelSizes,
    VoxelSizeSettings,
    fit_sizes_to_voxels,
)
from tracker.estimation.acquisition.part_derivatives import part_jacobian
from tracker.estimation.acquisition.piece_sums import GroupSums, sums_of_views
from tracker.estimation.acquisition.size_fit import SightedPerson, SizeFit, SizeFitSettings, fit_sizes_to_contours
from tracker.estimation.acquisition.size_parameters import SizeParameters, SizePriors, typical_body
from tracker.estimation.by_frame.forward_pass import update_static_edges
from tracker.estimation.by_frame.frame_problem import FrameProblem, PersonPrior
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.contour_residuals import MatchSettings, PieceSums
from tracker.estimation.fitting.gauss_newton import PointTargets
from tracker.estimation.fitting.pins import PinBlock
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.estimation.tracking.pose_errors import acquired_sigma_m
from tracker.estimation.tracking.view_regions import read_views
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import Camera

SizeMethod = Literal["contours", "voxels"]
"""Whether the fit to contours starts at the body before, or at a fit to voxels."""


@dataclass(frozen=True)
class AcquisitionSettings:
    """Settings of an acquisition."""

    n_frames: int = 6
    """Number of frames that are fitted at once."""
    candidates: int = 24
    """Number of frames, evenly spread, from which they are chosen."""
    rounds: int = 1
    """Largest number of times that frames are tracked for it and sizes are fitted. Each round
    tracks with the body of the one before. It is the last where most frames are good."""
    coupled: bool = True
    """Whether left and right have the same sizes."""
    priors: SizePriors = field(default_factory=SizePriors)
    fit: SizeFitSettings = field(default_factory=SizeFitSettings)
    voxels: VoxelSizeSettings | None = None
    """Of a fit to voxels, which takes the place of the first round and gives the start of the others; None for none."""


class Acquisition(NamedTuple):
    """An acquired body."""

    body: BodyModel
    frames: tuple[int, ...]
    """The frames that it was fitted to."""
    poses: tuple[np.ndarray, ...]
    """The pose of each of them with this body, (n_values,)."""
    cost_before_px: float
    """Mean cost over these frames with the body and the poses before, px."""
    cost_after_px: float
    """The same with the acquired body and its poses, px."""
    parameters: SizeParameters
    """The sizes that were fitted, relative to a body of typical proportions."""
    fit: SizeFit
    views: tuple[str, ...] = ()
    """Names of the views that it was fitted to; all of them if empty."""
    voxels: VoxelSizes | None = None
    """The fit to voxels before, if there was one."""
    joints_are_given: bool = False
    """Whether known or placed joints held the fit, or joints were left as they are."""
    before: BodyModel | None = None
    """The body before; None if it is that of the parameters."""

    @property
    def is_better(self) -> bool:
        """Whether the acquired body fits the contours better than the one before."""
        return self.cost_after_px < self.cost_before_px


def acquire_from_contours(
    observer: Observer,
    bodies: Mapping[int, tuple[PosedBody, ...]],
    person: int,
    placed: Mapping[int, PointTargets],
    settings: AcquisitionSettings,
    report: Report = unreported,
    seen: Mapping[int, PinBlock] = MappingProxyType({}),
) -> Acquisition:
    """Acquire the body of one person.

    Args:
        observer: of the recording.
        bodies: all people on each frame that may be used, in their present bodies.
        person: index of the person among them.
        placed: by frame, points of the person that were placed by hand or are known.
        settings: of the acquisition.
        report: shows progress.
        seen: by frame, points of the person that a user has marked in the images.

    Raises:
        TrackerError: there is no frame, or the views show nothing of the person.
    """
    if not bodies:
        raise TrackerError("expected at least one frame with a pose, found none; place the body on one first")
    bodies = moving(observer, bodies)
    present = next(iter(bodies.values()))[person].model
    parameters = SizeParameters(typical_body(present), settings.coupled, settings.priors)
    names = ("choosing frames", "reading contours", "fitting sizes to voxels", "fitting sizes")
    choosing, reading, measuring, fitting = stages(report, *names)
    choosing(0.0)
    # Placed joints are used wherever there are few of them; of many, the frames that show most.
    few = 0 < len(placed) <= settings.n_frames
    source = sorted(bodies) if few or not placed else sorted(k for k in bodies if k in placed)
    fixed = sorted(k for k in placed if k in bodies) if few else []
    candidates = _spread(source, settings.candidates, keep=fixed)
    typical = {k: _with_body(bodies[k], person, parameters.base) for k in candidates}
    frames = choose_frames(parameters, observer.working_cameras, typical, person, settings.n_frames, fixed)
    reading(0.0)
    static_edges = learn_static_edges(observer, {k: bodies[k] for k in candidates})
    sighted, observed, before = [], [], []
    for i, k in enumerate(frames):
        views = read_views(observer, k, bodies[k], static_edges)
        observed.append(views)
        before.append(ChamferCost(views, bodies[k]).at_prediction().total_px)
        sighted.append(
            SightedPerson(k, own_views(views, bodies[k], person), typical[k], person, placed.get(k), seen.get(k))
        )
        reading((i + 1) / len(frames))
    by_voxels, fit = None, settings.fit
    if settings.voxels is not None:
        fit = replace(fit, rounds=fit.rounds[1:])
        people = {k: (typical[k][person], *typical[k][:person], *typical[k][person + 1 :]) for k in frames}
        by_voxels = _fit_to_voxels(observer, parameters, people, settings.voxels, measuring)
    if not any(len(v.points_px) for s in sighted for v in s.views):
        raise TrackerError(
            f"expected contours of the person on frames {', '.join(map(str, frames))}, found no edges near the body; "
            "place it where the person is"
        )
    found = fit_sizes_to_contours(parameters, sighted, fit, by_voxels.start if by_voxels else None, fitting)
    after = [
        ChamferCost(views, s.moved(found.body, p).bodies).at_prediction().total_px
        for views, s, p in zip(observed, sighted, found.poses, strict=True)
    ]
    report("done", 1.0)
    are_given = any(k in placed for k in frames)
    return Acquisition(
        replace(found.body, joint_sigma_m=acquired_sigma_m(are_given)), tuple(frames), found.poses,
        float(np.mean(before)), float(np.mean(after)), parameters, found, voxels=by_voxels, joints_are_given=are_given,
        before=present,
    )  # fmt: skip


def moving(observer: Observer, bodies: Mapping[int, tuple[PosedBody, ...]]) -> Mapping[int, tuple[PosedBody, ...]]:
    """Return the people with their velocities, by their poses on the frames around, where pictures need them."""
    if not any(any(observer.ahead_frames(k)) for k in bodies):
        return bodies
    poses = {k: [b.values for b in own] for k, own in bodies.items()}
    return {k: moving_bodies([b.model for b in own], poses, k) for k, own in bodies.items()}


def _with_body(bodies: tuple[PosedBody, ...], person: int, body: BodyModel) -> tuple[PosedBody, ...]:
    """Return the people on a frame, one of them in another body with the joints in place."""
    own = bodies[person]
    moved = PosedBody(body, retarget_pose(own.values, own.model, body), own.velocity)
    return (*bodies[:person], moved, *bodies[person + 1 :])


def _fit_to_voxels(
    observer: Observer, parameters: SizeParameters, people: Mapping[int, tuple[PosedBody, ...]],
    settings: VoxelSizeSettings, report: Callable[[float], None],
) -> VoxelSizes:  # fmt: skip
    """Fit sizes to the voxels of some frames. On each, the person is the first of the people."""
    with closing(
        SilhouetteFinder(observer.cameras, observer.recording, recording_views=observer.recording_views)
    ) as finder:
        seen = [SilhouettedPerson(k, finder.silhouettes(k), own) for k, own in people.items()]
    return fit_sizes_to_voxels(parameters, seen, settings, report)


def _spread(frames: Sequence[int], n: int, keep: Sequence[int]) -> list[int]:
    """Return frames evenly spread over all, with those to keep."""
    return sorted({frames[i] for i in spread_indices(len(frames), n)} | (set(keep) & set(frames)))


def own_views(views: Sequence[ViewEvidence], bodies: tuple[PosedBody, ...], person: int) -> Sequence[ViewEvidence]:
    """Return the evidence of a frame without the edges that other people explain."""
    people = [PersonPrior(b.model, b.values, velocity=b.velocity) for b in bodies]
    return FrameProblem(views, people, TrackSettings()).own_evidence([person], bodies)[0]


def learn_static_edges(observer: Observer, bodies: Mapping[int, tuple[PosedBody, ...]]) -> list[StaticEdgeModel] | None:
    """Learn the static edges of views without masks and background; None if no view needs it."""
    if all(c.masks is not None or c.background is not None for c in observer.cameras):
        return None
    models = [StaticEdgeModel(c.size) for c in observer.working_cameras]
    for k, people in bodies.items():
        views = read_views(observer, k, people, models)
        contours = [occluding_contours.trace(people, v.camera) for v in views]
        visible = [c.pieces_px[~c.occluded] for c in contours]
        update_static_edges(models, views, visible)
    return models


_POSE_WEIGHT = 10.0
"""Weight of a known pose, per radian or metre: little, as poses are found together with the sizes."""


def choose_frames(
    parameters: SizeParameters,
    cameras: Sequence[Camera],
    bodies: Mapping[int, tuple[PosedBody, ...]],
    person: int,
    n_frames: int,
    fixed: Sequence[int] = (),
) -> list[int]:
    """Choose frames for an acquisition, in order.

    Args:
        parameters: the sizes to acquire; the body is that of the poses.
        cameras: all views, without lens distortion.
        bodies: all people on each frame to choose from.
        person: index of the person among them.
        n_frames: number of frames to choose, with those that are fixed.
        fixed: frames that are used in any case.
    """
    information = {k: _information(parameters, cameras, b, person) for k, b in bodies.items()}
    known = np.diag(1 / parameters.sigmas**2) + sum(information[k] for k in fixed)
    chosen = list(fixed)
    while len(chosen) < min(n_frames, len(bodies)):
        gains = {k: float(np.linalg.slogdet(known + f)[1]) for k, f in information.items() if k not in chosen}
        best = max(gains, key=lambda k: gains[k])
        chosen.append(best)
        known = known + information[best]
    return sorted(chosen)


def _information(
    parameters: SizeParameters, cameras: Sequence[Camera], bodies: Sequence[PosedBody], person: int
) -> Array:
    """Return the information matrix of the sizes by the visible contours of a frame, (n_sizes, n_sizes)."""
    body, (model, kinematics) = bodies[person], (bodies[person].model, bodies[person].kinematics)
    first, n = parts_of([b.model for b in bodies], person).start, len(parameters.names)
    J = part_jacobian(model, kinematics, parameters.derivatives(np.zeros(n)))
    contours = [occluding_contours.trace(bodies, c) for c in cameras]
    views = [(c, _visible_pieces(contour, first, body, c)) for c, contour in zip(cameras, contours, strict=True)]
    sums = GroupSums.zeros(0, J.shape[2])
    sums.add_body(sums_of_views(views, model, kinematics, J.shape[1]), J, np.zeros((0, J[:, :, 0].size)))
    H = sums.hessian
    by_pose = H[n:, n:] + np.eye(model.n_dofs) * _POSE_WEIGHT
    return np.asarray(H[:n, :n] - H[:n, n:] @ np.linalg.solve(by_pose, H[n:, :n]))


def _visible_pieces(contour: occluding_contours.Contour, first: int, body: PosedBody, camera: Camera) -> PieceSums:
    """Return the visible pieces of a body within the image, each with the information of a contour."""
    model: BodyModel = body.model
    middles = (contour.pieces_px[:, :2] + contour.pieces_px[:, 2:]) / 2
    parts = contour.parts.astype(np.int64) - first
    inside = np.all((middles >= 0) & (middles < camera.size), axis=1)
    own = ~contour.occluded & (parts >= 0) & (parts < len(model.parts)) & inside
    parts, along = parts[own], contour.pieces_px[own, 2:] - contour.pieces_px[own, :2]
    lengths = np.maximum(np.linalg.norm(along, axis=1), TINY)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / lengths[:, None]
    T = body.kinematics.Ts_world_part[parts]
    local = np.einsum("nji,nj->ni", T[:, :3, :3], contour.points_world[own] - T[:, :3, 3])
    unit_points = (local - model.centers_part[parts]) / np.array([s.half_axes for s in model.shapes])[parts]
    weights = MatchSettings().information_per_px * lengths
    squares = np.asarray(weights[:, None, None] * normals[:, :, None] * normals[:, None, :], np.float64)
    return PieceSums(parts, middles[own].astype(np.float64), unit_points, np.zeros((len(parts), 2)), squares)
