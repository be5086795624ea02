"""Assess a tracked figure by the voxels: which limbs lie in them, and what they hold that no part explains."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array
from tracker.tracking.confidence import Status
from tracker.tracking.voxel.figure import LIMBS
from tracker.tracking.voxel.frame_voxels import FrameVoxels, axis_points, occupied_near
from tracker.tracking.voxel.state import FilterState

_AXIS = np.linspace(-0.75, 0.75, 10)
"""Places along the axis of a part that are looked up, in half sizes."""
_LOST_SHARE, _DOUBTFUL_SHARE = 0.5, 0.85
"""A limb of whose axis less lies in voxels is lost, or doubtful."""
_LOST_VOLUME, _DOUBTFUL_VOLUME = 0.75, 0.4
"""Volume that no part explains, in volumes of a forearm, above which a limb is lost, or doubtful: it is elsewhere."""
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


def assess(
    state: FilterState, frame: FrameVoxels, unexplained: Array, innovation: float, coarse: Sequence[str]
) -> FigureAssessment:
    """Return the status of a figure.

    Args:
        state: as tracked.
        frame: the voxels.
        unexplained: voxels near the figure that belong to no part, (N, 3), metres.
        innovation: normalized innovation of the frame, per row.
        coarse: notes on the limbs that the voxels do not resolve.
    """
    if frame.n_views < 2:
        return FigureAssessment("lost", "fewer than two views show anybody: the body is where it was predicted")
    inside = occupied_near(frame.voxels, axis_points(state, _AXIS)).mean(axis=1)
    if inside.max() == 0.0:
        return FigureAssessment(
            "lost", "no voxels near the body: the silhouettes are empty or disagree; check that no camera has moved"
        )
    shares = {name: float(inside[list(parts)].min()) for name, parts in LIMBS.items()}
    worst = min(shares, key=lambda n: shares[n])
    display = worst.replace("_", " ")
    volume = len(unexplained) * frame.voxels.grid.size_m**3 / _forearm_m3(state)
    if shares[worst] < _LOST_SHARE or inside[:2].min() < _LOST_SHARE:
        return FigureAssessment("lost", f"{display} outside of the voxels" if shares[worst] < _LOST_SHARE else
                                "trunk or head outside of the voxels")  # fmt: skip
    if volume > _LOST_VOLUME:
        return FigureAssessment("lost", "voxels that no part explains: a limb is elsewhere")
    if coarse:
        return FigureAssessment("doubtful", "; ".join(coarse))
    if shares[worst] < _DOUBTFUL_SHARE:
        return FigureAssessment("doubtful", f"{display} partly outside of the voxels")
    if volume > _DOUBTFUL_VOLUME:
        return FigureAssessment("doubtful", "voxels that no part explains")
    if innovation > _MAX_INNOVATION:
        return FigureAssessment("doubtful", "moved farther than predicted")
    if frame.broken:
        return FigureAssessment(
            "doubtful",
            f"view {', '.join(frame.broken)} left out: it contradicts the others; check whether it has moved",
        )
    return FigureAssessment("good", "")


def unexplained_voxels(points: Array, states: Sequence[FilterState]) -> Array:
    """Return the voxels that lie beside all parts of all people, (N, 3), metres. Feet are no parts of a figure.

    Args:
        points: centres of the voxels, (M, 3), metres.
        states: the figures of all people.
    """
    free = np.ones(len(points), dtype=bool)
    for state in states:
        halves = state.sizes[:, 2, None] * state.rotations[:, :, 2]
        offsets = points[:, None] - state.centers
        along = np.clip(np.einsum("nmi,mi->nm", offsets, halves) / np.sum(halves**2, axis=1), -1, 1)
        distances = np.linalg.norm(offsets - along[..., None] * halves, axis=2)
        free &= (distances > state.sizes[:, :2].max(axis=1) + _BESIDE_M).all(axis=1)
        for calf in (8, 9):
            free &= np.linalg.norm(points - (state.centers[calf] - halves[calf]), axis=1) > _FOOT_M
    return points[free]


def _forearm_m3(state: FilterState) -> float:
    """Return the mean volume of the forearms, cubic metres."""
    return float(np.pi * 2 * np.prod(state.sizes[[6, 7]], axis=1).mean())
