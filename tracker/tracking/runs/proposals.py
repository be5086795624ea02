"""Poses that a person may have on a frame, by poses that are known: limbs exchanged, facing the other way, combined."""

from collections.abc import Iterator, Sequence

import numpy as np

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.fitting.gauss_newton import JOINT_M, UNKNOWN, PointTargets, PosePrior, ResidualBlock, solve
from tracker.fitting.hypothesis import limbs_elsewhere
from tracker.fitting.limb_exchange import exchanged, paired_limbs
from tracker.geometry.arrays import Array
from tracker.motion.shortest_step import nearest_equivalent
from tracker.tracking.runs.frame_hypotheses import Proposal


def other_sides(body: PosedBody) -> list[Proposal]:
    """Return the poses in which limbs of both sides are exchanged, and in which the person faces the other way."""
    pairs = [p for p in paired_limbs(limbs(body.model)) if len(p[0].parts) > 1]
    return [*(Proposal(exchanged(body, p), "exchange") for p in pairs), Proposal(turned_round(body), "turn")]


def turned_round(body: PosedBody) -> Array:
    """Return the pose, (n_values,), in which a person faces the other way and limbs lie where the others were."""
    model, names = body.model, list(body.model.point_names)
    targets = {i: names.index(other) for i in range(len(names)) if (other := mirror_part(names[i])) in names}
    points = np.array([*targets], dtype=np.int64)
    blocks: list[ResidualBlock] = [
        PointTargets(points, body.points_world[[*targets.values()]], np.full(len(points), 1 / JOINT_M)),
        PosePrior(model.neutral(), np.full(model.n_dofs, 1 / UNKNOWN)),
    ]
    half_turn = np.zeros(model.n_dofs)
    half_turn[np.flatnonzero((model.dof_joint == 0) & ~model.dof_is_length)[-1]] = np.pi
    start = model.retract(body.values, half_turn)
    return solve(model, start, blocks, None, max_iterations=25, tolerance=1e-3).pose


def continued(model: BodyModel, before: Array | None, here: Array) -> list[Proposal]:
    """Return a pose on the next frame: where it was, and moved on as from the frame before, (n_values,) each."""
    poses = [here]
    if before is not None:
        step = model.difference(here, nearest_equivalent(model, before, here, None))
        poses.append(model.clip(model.retract(here, step)))
    return [Proposal(pose, "neighbour") for pose in poses]


def combined(model: BodyModel, here: Array, others: Sequence[Array]) -> Iterator[Proposal]:
    """Yield a pose with each limb of others that have it elsewhere, and those others, (n_values,) each."""
    body = PosedBody(model, here)
    for other in others:
        apart = limbs_elsewhere(body, PosedBody(model, other))
        for limb in (x for x in limbs(model) if x.name in apart):
            step = np.where(limb.dofs, model.difference(other, here), 0.0)
            yield Proposal(model.clip(model.retract(here, step)), "combination")
        if apart:
            yield Proposal(other, "neighbour")
