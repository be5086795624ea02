"""Recover lost limbs: try a limb everywhere it can be, and refine the best poses.

Some thousand poses of the limb are ranked by a quick score along its axis, of the colours under it and the edges at
both its sides. The best, no two in one place, improve by random perturbation under the same score. Their contours are
then scored like those of any pose, and the cheapest are refined. Limbs that are lost together are searched together, by
beam search.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from tracker.body.kinematics import chain_poses, place_point
from tracker.body.limbs import Limb, Search, SearchKind
from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import nearest_equivalent
from tracker.compute.jit import njit
from tracker.compute.sampling import even_points
from tracker.compute.threads import N_HELPERS, kernel_pool
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import RecoverSettings
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import BEAM_NATS, CLEAR_NATS, SAME_POSE_M, Hypothesis, apart, distinct
from tracker.geometry.arrays import Array, IntArray

T = TypeVar("T")


def search_limbs(
    model: BodyModel, limbs: Sequence[Limb], initial: Hypothesis, others: Sequence[Array], scorer: PoseScorer
) -> list[Hypothesis]:
    """Search limbs that seem lost, one after the other, by beam search.

    A limb may be where another belongs, and each alone fits best as it is. Therefore the best poses of each limb, worse
    ones included, are kept while the next is searched.

    Args:
        model: the body.
        limbs: the limbs to search.
        initial: the refined pose, scored.
        others: poses whose limbs are tried as they are, such as that of the frame before, (n_values,) each.
        scorer: compares poses.

    Returns:
        The best pose, which is the initial one unless another is clearly better. Then those that are about as good,
        with a limb elsewhere, cheapest first.
    """
    settings, start = scorer.settings, initial
    beam = [start]
    for limb in limbs:
        beam = [x for x in beam if x.cost < beam[0].cost + BEAM_NATS]
        away = [p for x in limbs if x is not limb for p in x.parts]
        found = _search_limb(model, limb, away, beam, others, scorer)
        beam = distinct([*beam, *found], settings.beam_width)
    best = beam[0] if beam[0].cost < start.cost - CLEAR_NATS else start
    rest = [x for x in (*beam, start) if x is not best and x.cost < best.cost + CLEAR_NATS]
    return [best, *distinct([replace(best, cost=-np.inf), *rest], settings.beam_width)[1:]]


def search_entry(kind: SearchKind, searched: Sequence[Limb], start: Hypothesis, found: Sequence[Hypothesis]) -> Search:
    """Return the entry of a search of limbs.

    Args:
        kind: of the search.
        searched: the limbs.
        start: the pose before it.
        found: what `search_limbs` returned.
    """
    best, *rest = found
    taken = best is not start
    after = best.cost if taken else min((x.cost for x in rest if x is not start), default=None)
    return Search.of(kind, tuple(x.name for x in searched), start.cost, after, taken)


def _search_limb(
    model: BodyModel, limb: Limb, away: list[int], beam: Sequence[Hypothesis], others: Sequence[Array],
    scorer: PoseScorer,
) -> list[Hypothesis]:  # fmt: skip
    """Return the best poses of one limb, refined with the whole body.

    Args:
        model: the body.
        limb: the limb to search.
        away: indices of parts that occlude nothing while poses are ranked: those of other lost limbs.
        beam: poses of the body, which differ in parts that are away. Places of the limb are ranked around the first,
            and then scored with each.
        others: poses whose limb is tried as it is.
        scorer: compares poses.
    """

    def limb_only(scorer: PoseScorer, pose: Array) -> Hypothesis:
        return scorer.scored(
            model, solve_compiled_or_plain(model, pose, scorer.blocks, limb.dofs, 4, 1e-2, MIN_DECREASE)
        )

    def whole_body(scorer: PoseScorer, pose: Array) -> Hypothesis:
        return scorer.fitted(model, pose)

    of_limb = scorer.restricted_to(limb)
    poses = _candidates(model, limb, away, beam[0].pose, others, of_limb)
    if len(beam) > 1:
        poses = np.array([*poses, *(with_limb(model, k.pose, pose, limb) for k in beam[1:] for pose in poses)])
        poses = poses[np.argsort(of_limb.costs(poses), kind="stable")[: scorer.settings.n_limb_refined]]
    # Both sets of angles of a shoulder have the same prior then.
    poses = nearest_equivalent(model, poses, beam[0].pose, scorer.active_dofs)
    tried = [x for x in of_limb.each(limb_only, poses) if x.cost < beam[0].cost + BEAM_NATS]
    return scorer.each(whole_body, [x.pose for x in distinct(tried, scorer.settings.beam_width)])


def _candidates(
    model: BodyModel, limb: Limb, away: list[int], here: Array, others: Sequence[Array], scorer: PoseScorer
) -> Array:
    """Return the few poses of a limb that are worth a refinement, (n, n_values), best first."""
    settings = scorer.settings
    score = scorer.colors.limb_scorer(here, limb.parts, scorer.part_colors, away)
    proposals = _proposals(model, limb, here, settings)
    scores = np.concatenate(_map_split(score, proposals))
    best = _best_apart(model, limb, proposals, scores, settings.n_local_search)
    dofs = np.flatnonzero(limb.dofs)
    # Each pose improves by itself, so that threads do not wait for one another between rounds.
    rounds = [
        np.random.default_rng(i).normal(0.0, spread, (len(best), settings.perturbations, len(dofs)))
        for i, spread in enumerate(settings.perturbations_rad)
    ]
    best = np.concatenate(_map_split(lambda *share: _perturbed(model, dofs, score, *share), best, *rounds))
    best = np.array([*best, *(with_limb(model, here, other, limb) for other in others)])
    return _best_apart(model, limb, best, -scorer.costs(best), settings.n_limb_refined)


def _best_apart(model: BodyModel, limb: Limb, poses: Array, scores: Array, n: int) -> Array:
    """Return the best of many poses of a limb, no two of them the same, so that one good place leaves room for others.

    Args:
        model: the body.
        limb: whose points are compared.
        poses: (m, n_values); only the limb is compared.
        scores: of each, (m,); higher is better.
        n: largest number of poses to return.
    """
    points = np.flatnonzero(np.isin(model.point_parts, limb.parts))
    Ts = chain_poses(model.tree, model.kinematics(poses[0]), limb.parts, poses)
    places = np.empty((len(poses), len(points), 3))
    _put(Ts, np.searchsorted(limb.parts, model.point_parts[points]), model.points_part[points], places)
    return poses[apart(places, np.argsort(-scores), n, SAME_POSE_M)]


@njit(nogil=True, cache=True)
def _put(Ts: Array, parts: IntArray, points: Array, places: Array) -> None:
    """Transform points (k, 3) of parts, indices (k,), by part poses (m, n, 4, 4) to the world, (m, k, 3)."""
    for m in range(places.shape[0]):
        for k in range(places.shape[1]):
            places[m, k, 0], places[m, k, 1], places[m, k, 2] = place_point(Ts[m, parts[k]], points[k])


def with_limb(model: BodyModel, values: Array, other: Array, limb: Limb) -> Array:
    """Return a pose, (n_values,), with the limb of another."""
    change = np.where(limb.dofs, model.difference(other, values), 0.0)
    return model.move(values, change)


def _proposals(model: BodyModel, limb: Limb, values: Array, settings: RecoverSettings) -> Array:
    """Return poses with the limb elsewhere, (n, n_values): every other one nearby, the rest within the joint limits."""
    dofs = np.flatnonzero(limb.dofs)
    even, normal = even_points(settings.proposals, len(dofs))
    low, high = model.limits[dofs].T
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    now = model.difference(values, model.neutral())[dofs]
    near = normal * settings.reach_rad
    anywhere = low + even * (high - low) - now
    # Joints of little spread, such as collarbones, stay near.
    anywhere = np.where(np.isfinite(model.spreads[dofs]), near, anywhere)
    steps = np.where(np.arange(len(even))[:, None] % 2, near, anywhere)
    steps[1::4] *= 0.5
    return _moved(model, np.repeat(values[None], len(steps), axis=0), dofs, steps)


def _map_split(work: Callable[..., T], *arrays: Array) -> list[T]:
    """Apply work to shares of arrays of the same length, one for each helper thread; return the results in order."""
    return list(kernel_pool().map(work, *(np.array_split(a, N_HELPERS) for a in arrays)))


def _perturbed(
    model: BodyModel, dofs: IntArray, score: Callable[[Array], Array], poses: Array, *rounds: Array
) -> Array:
    """Improve poses, (n, n_values), by random perturbation: in each round each takes its best step, or none.

    Args:
        model: the body.
        dofs: indices of the degrees of freedom that are perturbed.
        score: returns the scores of poses, (n,).
        poses: (n, n_values).
        rounds: steps of each round, (n, n_steps, len(dofs)).
    """
    for steps in rounds:
        (n, n_steps), n_values = steps.shape[:2], poses.shape[1]
        moved = _moved(model, np.repeat(poses, n_steps, axis=0), dofs, steps.reshape(n * n_steps, len(dofs)))
        around = np.concatenate([poses[:, None], moved.reshape(n, n_steps, n_values)], axis=1)
        scores = score(around.reshape(n * (1 + n_steps), n_values)).reshape(n, 1 + n_steps)
        poses = around[np.arange(n), scores.argmax(axis=1)]
    return poses


def _moved(model: BodyModel, poses: Array, dofs: IntArray, steps: Array) -> Array:
    """Return poses, (n, n_values), after steps, (n, len(dofs)), in some degrees of freedom, within the joint limits."""
    if all(model.joints[j].kind == "revolute" for j in model.dof_joint[dofs]):
        out, at = poses.copy(), model.dof_value[dofs]
        out[:, at] = np.clip(poses[:, at] + steps, *model.limits[dofs].T)
        return out
    changes = np.zeros((len(poses), model.n_dofs))
    changes[:, dofs] = steps
    return np.array([model.move(pose, change) for pose, change in zip(poses, changes, strict=True)])
