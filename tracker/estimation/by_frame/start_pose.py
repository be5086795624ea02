"""Search the start pose of a run where the first frame contradicts it.

A person places a start by hand, to within several degrees of each joint and centimetres. Limbs may then lie on other
edges, and the colours under the parts are not theirs. The search keeps to the neighbourhood of the start, so that left
and right stay what the person said. It scores contours alone: colours are learnt from its result. Starts that a program
found are searched in the same way (`tracker.estimation.initialization.start_fit`).

Search a pose's surroundings along the directions that the contours hardly determine.

Local minima of the cost lie mostly along these directions: a pelvis that turned the wrong way under legs that fit, a
trunk bent in another joint. No search of a single limb gets there. Poses are therefore drawn from a normal distribution
with the covariance of the fit, made wider, and refined (covariance scaled sampling: C. Sminchisescu & B. Triggs 2001,
Covariance Scaled Sampling for Monocular 3D Body Tracking, CVPR).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Search
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.by_frame.assessment import PersonEstimate, assess_given_pose
from tracker.estimation.by_frame.frame_problem import Bodies, FrameProblem, PersonPrior, with_body
from tracker.estimation.by_frame.incremental_fit import fit_by_chains
from tracker.estimation.by_frame.limb_recovery import search_entry, search_limbs
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, OWN_TRUST, TOLERANCE, EstimationSettings
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import CLEAR_NATS, SAME_POSE_M, Hypothesis, distance_m
from tracker.estimation.fitting.limb_exchange import exchanged, paired_limbs
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

PLACED_RAD, PLACED_M = 0.35, 0.15
"""Standard deviation of a pose placed by hand, rad and metres: about twice the error that people leave."""
MAX_ROUNDS = 2
"""Largest number of rounds of a search, each with the evidence around the poses of the one before."""


class StartFrame(NamedTuple):
    """The first frame of a run, with all people in their start poses."""

    bodies: Bodies
    contours: Sequence[Contour]
    """Contours of all bodies in each view."""
    views: tuple[ViewEvidence, ...]
    """The evidence around them."""
    observe: Callable[[Bodies], tuple[ViewEvidence, ...]]
    """Returns the evidence around other poses."""


class SearchedStart(NamedTuple):
    """A start pose that was searched."""

    body: PosedBody
    """The person in the pose that was found."""
    trace: tuple[Search, ...]
    """The searches of the last round."""
    taken: bool
    """Whether it replaces the start."""


def settle_starts(
    frame: StartFrame, memories: Sequence[PersonMemory], people: Sequence[int], settings: EstimationSettings
) -> dict[int, SearchedStart]:
    """Search the start poses that the first frame contradicts.

    The start of a single person is searched where a limb is worth a search, and that of one of several where a limb is
    missing. Limbs are searched together with those of the other side, and exchanged with them. Nobody is searched who
    was tracked before: a motion is known of them, and the pose is a prediction.

    Args:
        frame: the first frame.
        memories: of each person, before the first frame.
        people: whose start is checked.
        settings: of the tracker.

    Returns:
        By person what was found; nobody whose start fits the frame.
    """
    if not settings.settles_start:
        return {}
    start, observe = frame.bodies, frame.observe
    known = [PersonPrior(m.model, b.values, m.active_dofs) for m, b in zip(memories, start, strict=True)]
    first = FrameProblem(frame.views, known, settings, (start, frame.contours))
    before = {p: assess_given_pose(first, p, start) for p in people if len(memories[p].history) == 1}
    # In a close hold a right start is doubtful, and a search may take the other's limb.
    least = 1 if len(memories) == 1 else 2
    doubted = [p for p, e in before.items() if _contradiction(e) >= least]
    if not doubted or not any(len(v.points_px) for v in first.views):
        return {}
    wide, bodies, traces = roughly_known(settings), start, dict[int, tuple[Search, ...]]()
    for _ in range(MAX_ROUNDS):
        problem, last = FrameProblem(observe(bodies), known, wide), bodies
        for person in doubted:
            body, traces[person] = search_start(problem, person, bodies, memories[person])
            bodies = with_body(bodies, person, body)
        if all(distance_m(a, b) < SAME_POSE_M for a, b in zip(last, bodies, strict=True)):
            break
    found = FrameProblem(observe(bodies), known, wide)
    out = {}
    for p in doubted:
        is_better = _contradiction(assess_given_pose(found, p, bodies)) <= _contradiction(before[p])
        trace = traces[p] if is_better else tuple(entry._replace(taken=False) for entry in traces[p])
        out[p] = SearchedStart(bodies[p], trace, is_better)
    return out


def _contradiction(estimate: PersonEstimate) -> int:
    """Return how strongly a frame contradicts a pose: 0 not, 1 a limb is worth a search, 2 a limb is missing."""
    quality = estimate.quality
    assert quality is not None
    if quality.missing_limbs or quality.is_body_lost:
        return 2
    return 1 if quality.limbs_to_search else 0


def roughly_known(settings: EstimationSettings) -> EstimationSettings:
    """Return the settings with which a start is searched: its prior is wide."""
    return replace(settings, trust_rad=PLACED_RAD, trust_m=PLACED_M)


def search_start(
    problem: FrameProblem, person: int, bodies: Bodies, memory: PersonMemory, n_draws: int = 0
) -> tuple[PosedBody, tuple[Search, ...]]:
    """Refine the pose of one person, search around it, and return the person in the cheapest pose, and the searches.

    Args:
        problem: of the frame, see `roughly_known`.
        person: whom to search. All limbs that have a counterpart are searched, and exchanged with it.
        bodies: all people.
        memory: of the person, before the frame.
        n_draws: number of searches along the directions that contours hardly determine, each with other samples.
    """
    model, recover, start = memory.model, problem.settings.recover, problem.people[person].predicted
    assert recover is not None
    (own,) = problem.own_evidence([person], bodies, everywhere=True)
    residuals = problem.residuals_on(own, person, bodies, everywhere=True)
    priors = problem.priors(person, bodies)
    blocks: list[ResidualBlock] = [residuals, *priors]
    fit = problem.solve(person, bodies[person].values, blocks, MAX_ITERATIONS)
    if problem.settings.incremental_start:
        *_, last = fit_by_chains(model, bodies[person].values, blocks, memory.active_dofs)
        fit = min(fit, last.fit, key=lambda f: f.cost)
    colors = Colors(own, *problem.around(person, bodies))
    scorer = PoseScorer.of(residuals, priors, colors, None, recover, memory.active_dofs)
    best, trace = scorer.scored(model, fit), list[Search]()
    for pair in paired_limbs(memory.limbs):
        before, (best, *rest) = best, search_limbs(model, pair, best, (start,), scorer)
        trace.append(search_entry("limbs", pair, before, [best, *rest]))
        swapped = scorer.scored(model, problem.solve(person, exchanged(best.body, pair), scorer.blocks, MAX_ITERATIONS))
        is_better, names = swapped.cost < best.cost, tuple(limb.name for limb in pair)
        trace.append(Search.of("exchange", names, best.cost, swapped.cost, is_better))
        best = swapped if is_better else best
    for draw in range(n_draws):
        best, entry = search_along_covariance(model, best, scorer, problem.sigma(person), draw)
        trace.append(entry)
    return best.body, tuple(trace)


_N_SAMPLES = 16
"""Poses that are drawn and refined in a search."""
_SCALE = 2.0
"""Factor of the standard deviations. Refinement leads smaller steps back to where they began."""


def search_along_covariance(
    model: BodyModel, found: Hypothesis, scorer: PoseScorer, sigma: Array, draw: int = 0
) -> tuple[Hypothesis, Search]:
    """Refine poses sampled around a pose, and return the cheapest and the entry of the search.

    Poses are compared without the prediction, since what it says has led to a doubtful pose.

    Args:
        model: the body.
        found: the refined pose.
        scorer: compares poses; the first of its priors is the prediction.
        sigma: standard deviations of a prediction, (n_dofs,), rad or metres.
        draw: number of the samples; another number gives others.

    Returns:
        The given pose refined again, unless another is cheaper by `CLEAR_NATS`. Its normal matrix is that of all
        blocks of the scorer.
    """

    own = OWN_TRUST * sigma

    def refined(scorer: PoseScorer, pose: Array) -> Hypothesis:
        held = PosePrior(pose, 1 / own)
        fit = solve_compiled_or_plain(
            model, pose, _blocks(scorer, held), scorer.active_dofs, MAX_ITERATIONS, TOLERANCE, MIN_DECREASE
        )
        return Hypothesis.refined(model, fit, scorer.cost(fit) - held.cost(model, fit.pose))

    here, *others = scorer.each(refined, [found.pose, *_samples(model, found.pose, scorer, own, draw)])
    cheapest = min(others, key=lambda x: x.cost)
    best = cheapest if cheapest.cost < here.cost - CLEAR_NATS else here
    entry = Search.of("samples", (), here.cost, cheapest.cost, best is cheapest)
    return scorer.scored(model, solve_compiled_or_plain(model, best.pose, scorer.blocks, scorer.active_dofs, 0)), entry


def _blocks(scorer: PoseScorer, held: PosePrior) -> list[ResidualBlock]:
    """Return the residual blocks with a prior in place of the prediction."""
    return [scorer.residuals, held, *scorer.priors[1:]]


def _samples(model: BodyModel, pose: Array, scorer: PoseScorer, sigma: Array, draw: int = 0) -> Sequence[Array]:
    """Return poses drawn around a pose, (n_values,) each."""
    free = np.flatnonzero(np.ones(model.n_dofs, dtype=bool) if scorer.active_dofs is None else scorer.active_dofs)
    blocks = _blocks(scorer, PosePrior(pose, 1 / sigma))
    around = solve_compiled_or_plain(model, pose, blocks, scorer.active_dofs, 0)
    # Steps with the inverse Hessian as covariance. Its eigenvalues would take a hundred times as long.
    factor = np.linalg.cholesky(around.hessian[np.ix_(free, free)])
    steps = np.zeros((_N_SAMPLES, model.n_dofs))
    steps[:, free] = _SCALE * np.linalg.solve(factor.T, _normal_samples(_N_SAMPLES, len(free), draw).T).T
    return [model.move(pose, step) for step in steps]


@lru_cache(maxsize=8)
def _normal_samples(n: int, dims: int, draw: int) -> Array:
    """Return the same standard normal samples, (n, dims), in each call of a draw: runs are repeatable."""
    out = np.random.default_rng(draw).normal(size=(n, dims))
    out.flags.writeable = False
    return out
