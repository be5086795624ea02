"""Compare starts limb by limb, and name the limbs that are elsewhere in starts that cost as much as the best one."""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import Limb, limb_display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.geometry.arrays import Array

_ELSEWHERE_M = 0.10
"""A limb is elsewhere if one of its joints is farther away, metres: then it counts as off."""
ABOUT_EQUAL = 1.03
"""Ratio of the costs of two starts below which they are about equally good. A short track from the same pose costs some
percent more or less after another refinement."""


def rivals_note(starts: Sequence[tuple[PosedBody, float]]) -> str:
    """Return a sentence on the limbs that are elsewhere in starts that cost about as much as the first.

    Args:
        starts: bodies of the same joint tree, and their costs, the cheapest first.

    Returns:
        The sentence; empty if no limb is elsewhere.
    """
    (body, cost), *others = starts
    close = [b for b, c in others if c < ABOUT_EQUAL * cost]
    found = {limb for b in close for limb in limbs_elsewhere(body.model, body.points_world, b.points_world)}
    names = [limb_display_name(limb.name) for limb in limbs(body.model) if limb.name in found]
    return f"another start costs about as much, with {', '.join(names)} elsewhere" if names else ""


def limbs_elsewhere(model: BodyModel, points: Array, others: Array, apart_m: float = _ELSEWHERE_M) -> tuple[str, ...]:
    """Return the names of the limbs that have a joint farther apart in two sets of the body's points, (n, 3) each."""
    apart = np.linalg.norm(points - others, axis=1) > apart_m

    def is_elsewhere(limb: Limb) -> bool:
        return bool(apart[np.isin(model.point_parts, limb.parts)].any())

    return tuple(limb.name for limb in limbs(model) if is_elsewhere(limb))
