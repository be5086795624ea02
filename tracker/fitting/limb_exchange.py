"""Exchange two limbs of a pose: a leg in front of the other, or a body seen from behind, is easily taken for it."""

from collections.abc import Sequence

import numpy as np

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import Limb
from tracker.body.model import PosedBody
from tracker.fitting.gauss_newton import JOINT_M, UNKNOWN, PointTargets, PosePrior, ResidualBlock, solve
from tracker.geometry.arrays import Array


def paired_limbs(limbs: Sequence[Limb]) -> list[tuple[Limb, Limb]]:
    """Return the limbs of one side with those of the other."""
    by_name = {limb.name: limb for limb in limbs}
    found = [(limb, by_name.get(mirror_part(limb.name) or "")) for limb in limbs]
    return [(one, other) for one, other in found if other is not None and one.parts[0] < other.parts[0]]


def exchanged(body: PosedBody, pair: tuple[Limb, Limb]) -> Array:
    """Return the pose, (n_values,), in which two limbs lie where the other was, as far as the joints allow."""
    model, pose, points_world = body.model, body.values, body.points_world
    names = list(model.point_names)
    of_pair = np.isin(model.point_parts, np.concatenate([limb.parts for limb in pair]))
    targets = {i: names.index(other) for i in np.flatnonzero(of_pair) if (other := mirror_part(names[i])) in names}
    points = np.array([*targets], dtype=np.int64)
    blocks: list[ResidualBlock] = [
        PointTargets(points, points_world[[*targets.values()]], np.full(len(points), 1 / JOINT_M)),
        PosePrior(model.neutral(), np.full(model.n_dofs, 1 / UNKNOWN)),
    ]
    return solve(model, pose, blocks, pair[0].dofs | pair[1].dofs, max_iterations=40, tolerance=1e-4).pose
