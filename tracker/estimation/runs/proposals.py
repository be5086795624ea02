"""Poses that a person may have on a frame, by poses that are known: limbs exchanged, facing the other way, combined."""

from collections.abc import Iterator, Sequence

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.velocity import nearest_equivalent
from tracker.estimation.by_frame.limb_recovery import with_limb
from tracker.estimation.fitting.hypothesis import limbs_elsewhere
from tracker.estimation.fitting.limb_exchange import exchanged, paired_limbs, turned_round
from tracker.estimation.runs.frame_hypotheses import Proposal
from tracker.geometry.arrays import Array


def other_sides(body: PosedBody) -> list[Proposal]:
    """Return the poses in which limbs of both sides are exchanged, and in which the person faces the other way."""
    pairs = [p for p in paired_limbs(limbs(body.model)) if len(p[0].parts) > 1]
    return [*(Proposal(exchanged(body, p), "exchange") for p in pairs), Proposal(turned_round(body), "turn")]


def continued(model: BodyModel, before: Array | None, here: Array) -> list[Proposal]:
    """Return a pose on the next frame: where it was, and moved on as from the frame before, (n_values,) each."""
    poses = [here]
    if before is not None:
        step = model.difference(here, nearest_equivalent(model, before, here, None))
        poses.append(model.move(here, step))
    return [Proposal(pose, "neighbour") for pose in poses]


def combined(model: BodyModel, here: Array, others: Sequence[Array]) -> Iterator[Proposal]:
    """Yield a pose with each limb of others that have it elsewhere, and those others, (n_values,) each."""
    body = PosedBody(model, here)
    for other in others:
        apart = limbs_elsewhere(body, PosedBody(model, other))
        for limb in (x for x in limbs(model) if x.name in apart):
            yield Proposal(with_limb(model, here, other, limb), "combination")
        if apart:
            yield Proposal(other, "neighbour")
