"""Fit the people on one frame to pins, to points that were placed by hand, and to edges.

Pins and placed points alone first bring a body near. Then the edges are added, at first with twice the outlier
distance.
"""

from collections.abc import Iterable, Sequence, Set
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.by_frame.frame_problem import prior_blocks
from tracker.estimation.by_frame.start_pose import PLACED_M, PLACED_RAD
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.clocked_residuals import SummedBlocks, at_time, person_residuals
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import CLOSE_ENOUGH, OTHER_BODY_M, ResidualBlock, solve, value_mask
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.pins import pin_block
from tracker.estimation.posing.grab import Constraints, holds_at
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation

_REACHES = (2.0, 1.0)
"""Outlier distances of the rounds, in those of the settings."""
_TRUNK_RAD = 0.05
"""Standard deviation of the body's rotation for pins alone, rad: less than that of a limb, since one pin moves a
limb, and only several move the body."""


class FrameFit(NamedTuple):
    """Poses of all people on a frame, fitted or unchanged."""

    poses: tuple[Array, ...]
    """Pose of each person, (n_values,)."""
    pinned: tuple[NDArray[np.bool_], ...]
    """Which values the pins determine, (n_values,) for each person. These are the degrees of freedom about which pins
    carry more information than edges and priors together, by the diagonals of their normal matrices."""


def fit_frame(
    bodies: Sequence[PosedBody],
    pins: Sequence[Sequence[PointObservation]],
    cameras: Sequence[Camera],
    views: Sequence[ViewEvidence] | None,
    settings: TrackSettings,
    people: Iterable[int],
    constraints: Sequence[Constraints] | None = None,
) -> FrameFit:
    """Fit some of the people on a frame to their pins and to the edges; the others are fixed.

    Args:
        bodies: all people, at their initial poses. Velocities count in views of other times than the frame's.
        pins: pins of each person.
        cameras: all views.
        views: evidence of each view. Without it only pins count, and people without pins stay.
        settings: settings of the contour residuals.
        people: indices of the people to fit.
        constraints: locked degrees of freedom and held points of each person; none by default. A held point stays
            where it was put in the views, or else where it is; edges and pins of other points move it by some
            centimetres at most. A pin of the point itself overrules it.
    """
    people = list(people)
    models, now = [b.model for b in bodies], [np.array(b.values) for b in bodies]
    constraints = constraints or [Constraints()] * len(models)
    active = [c.active_dofs for c in constraints]
    blocks = [_pin_blocks(b, cameras, p) if p else None for b, p in zip(bodies, pins, strict=True)]
    pinned = [np.zeros(len(m.value_names), dtype=bool) for m in models]
    # At their placed positions: pins of the trunk must not carry placed limbs away.
    held = [
        _held_blocks(PosedBody(m, v), cameras, c, {pin.point for pin in p})
        for m, v, c, p in zip(models, now, constraints, pins, strict=True)
    ]
    for person in people:
        block, model = blocks[person], models[person]
        if block is not None or held[person]:
            sigma = np.where(model.dof_is_length, OTHER_BODY_M, np.where(model.dof_joint == 0, _TRUNK_RAD, PLACED_RAD))
            now[person], pinned[person] = _fit_one(model, now[person], block, held[person], sigma, active[person])
    for reach in _REACHES if views is not None else ():
        for person in people:
            assert views is not None
            posed = [replace(b, values=v) for b, v in zip(bodies, now, strict=True)]
            model = models[person]
            theta_px = settings.theta_px  # None: that of each view
            if reach != 1.0:
                theta_px = reach * (theta_px or float(np.median([v.theta_px / v.scale for v in views])))
            match = person_residuals(views, posed, person, settings.match, theta_px, everywhere=True)
            sigma = np.where(model.dof_is_length, PLACED_M, PLACED_RAD)
            now[person], pinned[person] = _fit_one(
                model, now[person], blocks[person], [match, *held[person]], sigma, active[person]
            )  # fmt: skip
    return FrameFit(tuple(now), tuple(pinned))


def _pin_blocks(body: PosedBody, cameras: Sequence[Camera], pins: Sequence[PointObservation]) -> ResidualBlock:
    """Return the residuals of pins, each at the time of its picture."""
    by_time = {time: [p for p in pins if p.ahead_frames == time] for time in {p.ahead_frames for p in pins}}
    return SummedBlocks(
        [at_time(pin_block(body.model, cameras, p), body.velocity, time) for time, p in by_time.items()]
    )


def _held_blocks(
    body: PosedBody, cameras: Sequence[Camera], constraints: Constraints, pinned: Set[str]
) -> list[ResidualBlock]:
    """Return the residuals of the held points that no pin overrules.

    Points that were placed in some views belong there, because a later drag may have moved them. The others
    belong where they are.
    """
    held = {name: views for name, views in constraints.held.items() if name not in pinned}
    seen = [at for at in constraints.seen if at.point in held]
    here = {name: views for name, views in held.items() if name not in {at.point for at in seen}}
    blocks: list[ResidualBlock] = []
    if here:
        blocks.append(holds_at(body.model, body.values, here).scaled(1 / OTHER_BODY_M))
    if seen:
        block = pin_block(body.model, cameras, seen)
        places = body.points_world[block.points]
        at_depths_m = [abs(float(c.depths(at))) for c, at in zip(block.cameras, places, strict=True)]
        held_px = [c.K[0, 0] * OTHER_BODY_M / d for c, d in zip(block.cameras, at_depths_m, strict=True)]
        blocks.append(replace(block, sigmas_px=np.hypot(block.sigmas_px, held_px)))
    return blocks


def _fit_one(
    model: BodyModel,
    pose: Array,
    pins: ResidualBlock | None,
    evidence: Sequence[ResidualBlock],
    sigmas: Array,
    active_dofs: NDArray[np.bool_] | None,
) -> tuple[Array, NDArray[np.bool_]]:
    """Fit one person from a pose with a prior; return the pose and which of its values the pins determine."""
    blocks = [*evidence, *prior_blocks(model, pose, sigmas), *([pins] if pins is not None else [])]
    # No kernel covers points that are pinned or held.
    has_points = pins is not None or not all(isinstance(b, ContourResiduals) for b in evidence)
    fit = (solve if has_points else solve_compiled_or_plain)(model, pose, blocks, active_dofs, tolerance=CLOSE_ENOUGH)
    if pins is None:
        return fit.pose, np.zeros(len(model.value_names), dtype=bool)
    by_pins = np.diag(pins.linearize(model, fit.pose, model.kinematics(fit.pose)).hessian)
    return fit.pose, value_mask(model, by_pins > 0.5 * np.diag(fit.hessian))
