"""Exchange two limbs of a pose: a leg in front of the other, or a body seen from behind, is easily taken for it."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import Limb
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import JOINT_M, UNKNOWN, PointTargets, PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.geometry.arrays import Array


def paired_limbs(limbs: Sequence[Limb]) -> list[tuple[Limb, Limb]]:
    """Return the limbs of one side with those of the other."""
    by_name = {limb.name: limb for limb in limbs}
    found = [(limb, by_name.get(mirror_part(limb.name) or "")) for limb in limbs]
    return [(one, other) for one, other in found if other is not None and one.parts[0] < other.parts[0]]


def exchanged(body: PosedBody, pair: tuple[Limb, Limb]) -> Array:
    """Return the pose, (n_values,), in which two limbs lie where the other was, as far as the joints allow."""
    of_pair = np.isin(body.model.point_parts, np.concatenate([limb.parts for limb in pair]))
    blocks = _mirrored(body, np.flatnonzero(of_pair).tolist())
    moved = pair[0].dofs | pair[1].dofs
    return solve_compiled_or_plain(body.model, body.values, blocks, moved, gain=MIN_DECREASE).pose


def turned_round(body: PosedBody) -> Array:
    """Return the pose, (n_values,), in which a person faces the other way and limbs lie where the others were."""
    model = body.model
    half_turn = np.zeros(model.n_dofs)
    half_turn[np.flatnonzero((model.dof_joint == 0) & ~model.dof_is_length)[-1]] = np.pi
    blocks = _mirrored(body, range(len(model.point_names)))
    return solve_compiled_or_plain(model, model.retract(body.values, half_turn), blocks, gain=MIN_DECREASE).pose


def _mirrored(body: PosedBody, moved: Sequence[int]) -> list[ResidualBlock]:
    """Return what draws some points of a body, by their indices, to where those of the other side are."""
    model, other_side = body.model, _other_side(body.model)
    targets = {i: other_side[i] for i in moved if i in other_side}
    points = np.array([*targets], dtype=np.int64)
    return [
        PointTargets(points, body.points_world[[*targets.values()]], np.full(len(points), 1 / JOINT_M)),
        PosePrior(model.neutral(), np.full(model.n_dofs, 1 / UNKNOWN)),
    ]


@lru_cache(maxsize=32)
def _other_side(model: BodyModel) -> dict[int, int]:
    """Return the index of the point on the other side by that of each point that has one."""
    names = list(model.point_names)
    return {i: names.index(other) for i, name in enumerate(names) if (other := mirror_part(name)) in names}
