"""Assess a tracked figure by the voxels: which limbs lie in them, and what they hold that no part explains."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import display_name
from tracker.estimation.tracking.confidence import Status
from tracker.estimation.voxel.figure import HEAD, LIMBS, TORSO
from tracker.estimation.voxel.frame_voxels import AXIS, FrameVoxels, axis_points, occupied_near
from tracker.estimation.voxel.state import FilterState
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array

_LOST_SHARE, _DOUBTFUL_SHARE = 0.5, 0.85
"""A limb of whose axis less lies in voxels is lost, or doubtful."""
_UNEXPLAINED = 0.4
"""Volume that no part explains, in volumes of a forearm, above which a limb partly outside of the voxels is lost, and
any other pose is doubtful."""
_BESIDE_M, _FOOT_M = 0.07, 0.30
"""Distance from the surface of a part beyond which voxels are not its skin, and from a calf's end within which they are
a foot, metres."""
_MAX_INNOVATION = 8.0
"""Normalized innovation per row above which the prediction was wrong."""


class FigureAssessment(NamedTuple):
    """How well a figure fits its voxels."""

    status: Status
    note: str
    """The main reason against it, for people to read; empty where it is good."""
    lost_limbs: frozenset[str] = frozenset()
    """Names of the limbs outside of the voxels."""


def assess(
    state: FilterState,
    frame: FrameVoxels,
    unexplained: "UnexplainedVoxels",
    innovation: float,
    coarse: Sequence[str],
    lost_before: Collection[str] = (),
) -> FigureAssessment:
    """Return the status of a figure.

    A limb that was lost is lost until it lies in voxels like a good one: on its way through the trunk it has not been
    found.

    Args:
        state: as tracked.
        frame: the voxels.
        unexplained: voxels near the person that no figure explains.
        innovation: normalized innovation of the frame, per row.
        coarse: notes on the limbs that the voxels do not resolve.
        lost_before: the `lost_limbs` of the frame before.
    """
    if frame.n_views < 2:
        return FigureAssessment("lost", "fewer than two views show anybody: the body is where it was predicted")
    inside = occupied_near(frame.voxels, axis_points(state, AXIS)).mean(axis=1)
    if inside.max() == 0.0:
        return FigureAssessment(
            "lost", "no voxels near the body: the silhouettes are empty or disagree; check that no camera has moved"
        )
    shares = {name: float(inside[list(parts)].min()) for name, parts in LIMBS.items()}
    worst = min(shares, key=lambda n: shares[n])
    volume = len(unexplained.points) * frame.voxels.grid.size_m**3 / _forearm_m3(state)
    lost = frozenset(n for n, s in shares.items() if s < (_DOUBTFUL_SHARE if n in lost_before else _LOST_SHARE))
    if lost:
        display = display_name(min(lost, key=lambda n: shares[n]))
        return FigureAssessment("lost", f"{display} outside of the voxels", lost)
    if inside[[TORSO, HEAD]].min() < _LOST_SHARE:
        return FigureAssessment("lost", "trunk or head outside of the voxels")
    # A limb that is elsewhere has left its place. Where all limbs lie in voxels, the hull may hold a phantom.
    if volume > _UNEXPLAINED and shares[worst] < _DOUBTFUL_SHARE:
        return FigureAssessment("lost", "voxels that no part explains: a limb is elsewhere")
    if coarse:
        return FigureAssessment("doubtful", "; ".join(coarse))
    if shares[worst] < _DOUBTFUL_SHARE:
        return FigureAssessment("doubtful", f"{display_name(worst)} partly outside of the voxels")
    if volume > _UNEXPLAINED:
        return FigureAssessment("doubtful", "voxels that no part explains")
    if unexplained.touches:
        return FigureAssessment("doubtful", "touches another person in the voxels")
    if innovation > _MAX_INNOVATION:
        return FigureAssessment("doubtful", "moved farther than predicted")
    if frame.broken:
        return FigureAssessment(
            "doubtful",
            f"view {', '.join(frame.broken)} left out: its silhouette holds little of the body that the others show",
        )
    return FigureAssessment("good", "")


class UnexplainedVoxels(NamedTuple):
    """Voxels near a person that no figure explains."""

    points: Array
    """Voxels beside all parts of all people that are connected with the person and closest to them, (N, 3), metres."""
    touches: bool
    """Whether voxels connect the person with another one."""


def unexplained_voxels(voxels: Voxels, states: Sequence[FilterState]) -> list[UnexplainedVoxels]:
    """Return for each person the voxels that no figure explains. Feet are no parts of a figure.

    The visual hull of several people has phantom volumes: voxels that are connected with no figure are ignored.

    Args:
        voxels: of the frame.
        states: the figures of all people.
    """
    points = voxels.points_world
    distances, is_free = np.empty((len(states), len(points))), np.ones(len(points), dtype=bool)
    for p, state in enumerate(states):
        distances[p] = _distances(points, state)
        is_free &= distances[p] > _BESIDE_M
        for calf in (LIMBS["left_leg"][1], LIMBS["right_leg"][1]):
            foot = state.centers[calf] - state.sizes[calf, 2] * state.rotations[calf, :, 2]
            is_free &= np.linalg.norm(points - foot, axis=1) > _FOOT_M
    if len(states) == 1:
        return [UnexplainedVoxels(points[is_free], False)]
    from scipy.ndimage import label  # imported lazily: loading scipy takes 0.2 s

    regions = label(voxels.occupied, np.ones((3, 3, 3)))[0][tuple(voxels.indices.T)]
    touched = [np.unique(regions[d <= 0]) for d in distances]
    closest, found = distances.argmin(axis=0), []
    for p, own in enumerate(touched):
        others = np.concatenate([t for q, t in enumerate(touched) if q != p])
        mine = points[is_free & (closest == p) & np.isin(regions, own)]
        found.append(UnexplainedVoxels(mine, bool(np.isin(own, others).any())))
    return found


def _distances(points: Array, state: FilterState) -> Array:
    """Return the distance of points, (N, 3), from the surface of the closest part, (N,), metres; negative inside."""
    halves = state.sizes[:, 2, None] * state.rotations[:, :, 2]
    offsets = points[:, None] - state.centers
    along = np.clip(np.einsum("nmi,mi->nm", offsets, halves) / np.sum(halves**2, axis=1), -1, 1)
    distances = np.linalg.norm(offsets - along[..., None] * halves, axis=2) - state.sizes[:, :2].max(axis=1)
    return np.asarray(distances.min(axis=1))


def _forearm_m3(state: FilterState) -> float:
    """Return the mean volume of the forearms, cubic metres."""
    return float(np.pi * 2 * np.prod(state.sizes[[6, 7]], axis=1).mean())
