"""Contour residuals of views whose pictures were taken at different times.

A picture that was taken d frames after the frame shows the body in the pose q moved by d v, with v its velocity. Views
of equal times form a group with residuals of its own, which are evaluated there. The velocity stays while a pose is
fitted, so that the derivative of the moved pose by the pose is the identity, for ball joints to first order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.estimation.fitting.contour_residuals import ContourResiduals, MatchSettings, PartCosts
from tracker.estimation.fitting.gauss_newton import NormalEquations, ResidualBlock
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class MovedBlock:
    """A residual block at a pose that is moved by a constant step; see `ResidualBlock`."""

    block: ResidualBlock
    step: Array
    """(n_dofs,), rad or metres."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        moved = model.retract(pose, self.step)
        return self.block.linearize(model, moved, model.kinematics(moved))


def at_time(block: ResidualBlock, velocity: Array | None, ahead_frames: float) -> ResidualBlock:
    """Return a block that sees a body some frames later, by its velocity, (n_dofs,); as it is if that is unknown."""
    return block if velocity is None or ahead_frames == 0.0 else MovedBlock(block, ahead_frames * velocity)


@dataclass(frozen=True, eq=False)
class SummedBlocks:
    """Several residual blocks as one; see `ResidualBlock`."""

    blocks: Sequence[ResidualBlock]

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        found = [b.linearize(model, pose, kinematics) for b in self.blocks]
        return NormalEquations(
            sum(f.cost for f in found), np.sum([f.gradient for f in found], axis=0),
            np.sum([f.hessian for f in found], axis=0),
        )  # fmt: skip


class _Group(NamedTuple):
    """Views whose pictures were taken at the same time."""

    views: IntArray
    """Their indices, (V,)."""
    ahead_frames: float
    """Frames by which the pictures were taken later than the frame."""
    residuals: ContourResiduals

    def moved(self, model: BodyModel, poses: Array, velocity: Array) -> Array:
        """Return poses, (n, n_values), at the time of the pictures."""
        return PosedBody(model, poses[0], velocity).poses_ahead(poses, self.ahead_frames)


@dataclass(frozen=True, eq=False)
class ClockedResiduals:
    """Residuals of one person's contours in groups of views, with the methods of `ContourResiduals`."""

    model: BodyModel
    velocity: Array
    """Change of the person's pose from one frame to the next, (n_dofs,), rad or metres."""
    groups: tuple[_Group, ...]

    def with_velocity(self, velocity: Array) -> "ClockedResiduals":
        """Return the same residuals for another velocity of the person, (n_dofs,). Both use the same buffers."""
        return ClockedResiduals(self.model, velocity, self.groups)

    def with_information(self, factor: float) -> "ClockedResiduals":
        """See `ContourResiduals.with_information`."""
        return self._with([g.residuals.with_information(factor) for g in self.groups])

    def restricted_to(self, parts: IntArray) -> "ClockedResiduals":
        """See `ContourResiduals.restricted_to`."""
        return self._with([g.residuals.restricted_to(parts) for g in self.groups])

    def clone_for_thread(self) -> "ClockedResiduals":
        """See `ContourResiduals.clone_for_thread`."""
        return self._with([g.residuals.clone_for_thread() for g in self.groups])

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        assert model is self.model
        blocks = [at_time(g.residuals, self.velocity, g.ahead_frames) for g in self.groups]
        return SummedBlocks(blocks).linearize(model, pose, kinematics)

    def costs(self, candidates: Array) -> Array:
        """See `ContourResiduals.costs`."""
        return np.asarray(self.view_costs(candidates).sum(axis=1))

    def view_costs(self, candidates: Array) -> Array:
        """See `ContourResiduals.view_costs`; the views are in their order."""
        order = np.argsort(np.concatenate([g.views for g in self.groups]))
        found = [g.residuals.view_costs(g.moved(self.model, candidates, self.velocity)) for g in self.groups]
        return np.concatenate(found, axis=1)[:, order]

    def part_costs(self, pose: Array) -> PartCosts:
        """See `ContourResiduals.part_costs`; the views are in their order."""
        order = np.argsort(np.concatenate([g.views for g in self.groups]))
        found = [g.residuals.part_costs(g.moved(self.model, pose[None], self.velocity)[0]) for g in self.groups]
        return PartCosts(*(np.concatenate(of_groups)[order] for of_groups in zip(*found, strict=True)))

    def _with(self, residuals: Sequence[ContourResiduals]) -> "ClockedResiduals":
        groups = tuple(g._replace(residuals=r) for g, r in zip(self.groups, residuals, strict=True))
        return ClockedResiduals(self.model, self.velocity, groups)


PersonResiduals: TypeAlias = ContourResiduals | ClockedResiduals


def person_residuals(
    views: Sequence[ViewEvidence],
    bodies: Sequence[PosedBody],
    person: int = 0,
    settings: MatchSettings | None = None,
    theta_px: float | None = None,
    everywhere: bool = False,
    contours: Sequence[Contour] | None = None,
) -> PersonResiduals:
    """Return the residuals of a person's contours against the edges of all views, each at the time of its picture.

    Without a velocity of the person, all views count as of the time of the frame.

    Args:
        views: evidence of each view.
        bodies: all bodies in the scene, as predicted.
        person: index of the body that is fitted.
        settings: see `ContourResiduals`.
        theta_px: see `ContourResiduals`.
        everywhere: see `ContourResiduals`.
        contours: predicted contours of all bodies in each view, at the time of its picture; traced here by default.
    """
    times, velocity = np.array([v.ahead_frames for v in views]), bodies[person].velocity
    if velocity is None or not times.any():
        return ContourResiduals(views, bodies, person, settings, theta_px, everywhere, contours)
    groups = []
    for time in np.unique(times):
        chosen = np.flatnonzero(times == time)
        of_group = None if contours is None else [contours[i] for i in chosen.tolist()]
        seen, then = [views[i] for i in chosen.tolist()], ahead(bodies, float(time))
        residuals = ContourResiduals(seen, then, person, settings, theta_px, everywhere, of_group)
        groups.append(_Group(chosen, float(time), residuals))
    return ClockedResiduals(bodies[person].model, velocity, tuple(groups))
