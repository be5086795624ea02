"""Name the limbs that a fit moved although nobody had touched them."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Limb, limbs
from tracker.body.model import BodyModel
from tracker.estimation.fitting.hypothesis import SAME_POSE_M
from tracker.estimation.posing.edits import copy_dofs, limb_of
from tracker.geometry.arrays import Array


class LimbMove(NamedTuple):
    """A limb that was moved."""

    limb: Limb
    distance_m: float
    """Largest distance between its points and their places with its joints as before."""


def untouched_moves(model: BodyModel, before: Array, after: Array, touched: Collection[str]) -> list[LimbMove]:
    """Return the limbs that moved by their own joints and that nobody had touched, farthest first.

    A limb has moved if one of its points is farther away than `SAME_POSE_M`.

    A limb that was still in the neutral pose is left out: nothing had placed it yet.

    Args:
        model: the body.
        before: its pose before, (n_values,).
        after: its pose after, (n_values,).
        touched: names of the points that a person had placed; their limbs are left out.
    """
    own = {limb_of(model, point)[0] for point in touched}
    bends = model.difference(before, model.neutral())
    points_world, found = model.points_world(after), list[LimbMove]()
    for limb in limbs(model):
        is_posed = bool(np.any(bends[limb.dofs]))
        if is_posed and limb.name not in own:
            back = model.points_world(copy_dofs(model, after, before, limb.dofs))
            distance_m = float(np.linalg.norm(back - points_world, axis=1).max())
            if distance_m > SAME_POSE_M:
                found.append(LimbMove(limb, distance_m))
    return sorted(found, key=lambda move: -move.distance_m)
