"""One frame fitted at a person's word: pins and edges together, by the one solver and the tracker's blocks.

First the pins alone, where there are any, bring the body near; then the edges come in, at first from twice as far.
(On 12 frames of three recordings, limb joints 139 mm off on average and a body of other bones, which cannot come nearer
than 25 mm: 56 mm by edges alone, 71 without the first, far round; with one wrist pinned in one view 50 mm; with wrists
and ankles pinned in two views, 3 px off, 45 mm.)
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import ContourResiduals
from tracker.fitting.gauss_newton import ResidualBlock, value_mask
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.fitting.pins import PinBlock, pin_block
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation
from tracker.tracking.chamfer.settings import TrackSettings, prior_blocks

_REACHES = (2.0, 1.0)
"""Outlier distances of one round after the other, in those of the settings."""
_TRUST_RAD, _TRUST_M = 0.3, 0.1
"""Standard deviation of the pose that a round begins with: a hand places a limb less well than a tracker predicts."""
_LIMB_RAD, _TRUNK_RAD, _PLACE_M = 0.3, 0.05, 0.02
"""The same for pins alone, of joints, of the body's turns and its place: one pin moves a limb, several the body."""
_ITERATIONS, _TOLERANCE = 30, 1e-3


class FrameFit(NamedTuple):
    """Everybody on a frame, fitted or left as they were."""

    poses: tuple[Array, ...]
    """Pose of each person, (n_values,)."""
    pinned: tuple[NDArray[np.bool_], ...]
    """Which values the pins determine, (n_values,) for each person: those of degrees of freedom of which pins tell more
    than edges and priors together, by the diagonals of their normal matrices."""


def fit_frame(
    models: Sequence[BodyModel],
    poses: Sequence[Array],
    pins: Sequence[Sequence[PointObservation]],
    cameras: Sequence[Camera],
    views: Sequence[ViewEvidence] | None,
    settings: TrackSettings,
    people: Iterable[int],
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> FrameFit:
    """Fit some of the people on a frame to their pins and to the edges, the others as they stand.

    Args:
        models: the body of each person.
        poses: where each stands, (n_values,).
        pins: the pins of each.
        cameras: all views.
        views: the evidence of each; without it pins are all there is, and who has none stays.
        settings: how contours match edges.
        people: whom to fit.
        free: which degrees of freedom of each person may move, (n_dofs,); all by default.
    """
    people = list(people)
    now = [np.array(p) for p in poses]
    masks = [None] * len(models) if free is None else list(free)
    blocks = [pin_block(m, cameras, p) if p else None for m, p in zip(models, pins, strict=True)]
    pinned = [np.zeros(len(m.value_names), dtype=bool) for m in models]
    for person in people:
        block, model = blocks[person], models[person]
        if block is not None:
            sigma = np.where(model.dof_is_length, _PLACE_M, np.where(model.dof_joint == 0, _TRUNK_RAD, _LIMB_RAD))
            now[person], pinned[person] = _fit_one(model, now[person], block, [], sigma, masks[person])
    for reach in _REACHES if views is not None else ():
        for person in people:
            assert views is not None
            bodies, model = [PosedBody(m, v) for m, v in zip(models, now, strict=True)], models[person]
            theta_px = settings.theta_px  # None: that of each view
            if reach != 1.0:
                theta_px = reach * (theta_px or float(np.median([v.theta_px / v.scale for v in views])))
            match = ContourResiduals(views, bodies, person, settings.match, theta_px, everywhere=True)
            sigma = np.where(model.dof_is_length, _TRUST_M, _TRUST_RAD)
            now[person], pinned[person] = _fit_one(model, now[person], blocks[person], [match], sigma, masks[person])
    return FrameFit(tuple(now), tuple(pinned))


def _fit_one(
    model: BodyModel,
    values: Array,
    pins: PinBlock | None,
    evidence: Sequence[ResidualBlock],
    sigmas: Array,
    mask: NDArray[np.bool_] | None,
) -> tuple[Array, NDArray[np.bool_]]:
    """Fit one person from a pose that is trusted so far; returns the pose and which of its values pins determine."""
    blocks = [*evidence, *prior_blocks(model, values, sigmas), *([pins] if pins is not None else [])]
    fit = solve_compiled(model, values, blocks, mask, _ITERATIONS, _TOLERANCE)
    if pins is None:
        return fit.pose, np.zeros(len(model.value_names), dtype=bool)
    by_pins = np.diag(pins.linearize(model, fit.pose, model.kinematics(fit.pose)).hessian)
    return fit.pose, value_mask(model, by_pins > 0.5 * np.diag(fit.hessian))
