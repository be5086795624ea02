"""Find pairs of people on a frame who fit the evidence about as well with their identities swapped."""

from collections.abc import Mapping
from itertools import combinations

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.frame_problem import Bodies, FrameProblem, PersonFit, with_body
from tracker.estimation.fitting.hypothesis import BEAM_NATS, CLEAR_NATS
from tracker.geometry.arrays import Array


def identity_swaps(
    problem: FrameProblem, bodies: Bodies, fits: Mapping[int, PersonFit]
) -> dict[tuple[int, int], tuple[Array, ...]]:
    """Return the pairs that may be swapped, and the poses of all people, (n_values,) each, with that pair swapped.

    Each of a pair takes the other's pose and is refined there, with their own prediction and their own colours.

    Args:
        problem: of the frame.
        bodies: all people as they were found.
        fits: of the people who were tracked.
    """
    swaps, recover = {}, problem.settings.recover
    color_weight = recover.colors if recover else 0.0
    for p, q in combinations(fits, 2):
        if bodies[p].model.value_names != bodies[q].model.value_names or not _is_plausible(problem, bodies, p, q):
            continue
        here = sum(fits[i].fit.cost - color_weight * problem.color_nats(i, bodies) for i in (p, q))
        swapped = with_body(bodies, p, PosedBody(bodies[p].model, bodies[q].values))
        swapped = with_body(swapped, q, PosedBody(bodies[q].model, bodies[p].values))
        there = 0.0
        for i in (p, q):
            refined = problem.refine(i, swapped, fits[i])
            swapped = with_body(swapped, i, refined.body)
            there += refined.fit.cost - color_weight * problem.color_nats(i, swapped)
        if there < here + CLEAR_NATS:
            swaps[p, q] = tuple(b.values for b in swapped)
    return swaps


def _is_plausible(problem: FrameProblem, bodies: Bodies, p: int, q: int) -> bool:
    """Return whether the predictions of two people admit a swap."""
    increase = 0.0
    for i, other in ((p, q), (q, p)):
        model, prediction = bodies[i].model, problem.priors(i, bodies)[0]
        swapped, own = (
            prediction.linearize(model, bodies[k].values, model.kinematics(bodies[k].values)).cost for k in (other, i)
        )
        increase += swapped - own
    return increase < BEAM_NATS
