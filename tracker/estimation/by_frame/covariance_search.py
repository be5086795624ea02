"""Search a pose's surroundings along the directions that the contours hardly determine.

Local minima of the cost lie mostly along these directions: a pelvis that turned the wrong way under legs that fit, a
trunk bent in another joint. No search of a single limb gets there. Poses are therefore drawn from a normal distribution
with the covariance of the fit, made wider, and refined (covariance scaled sampling: C. Sminchisescu & B. Triggs 2001,
Covariance Scaled Sampling for Monocular 3D Body Tracking, CVPR).
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.searches import Search
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, OWN_TRUST, TOLERANCE
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_fast
from tracker.estimation.fitting.hypothesis import CLEAR_NATS, Hypothesis
from tracker.geometry.arrays import Array

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
        fit = solve_fast(
            model, pose, _blocks(scorer, held), scorer.active_dofs, MAX_ITERATIONS, TOLERANCE, MIN_DECREASE
        )
        return Hypothesis.refined(model, fit, scorer.cost(fit) - held.cost(model, fit.pose))

    here, *others = scorer.each(refined, [found.pose, *_samples(model, found.pose, scorer, own, draw)])
    cheapest = min(others, key=lambda x: x.cost)
    best = cheapest if cheapest.cost < here.cost - CLEAR_NATS else here
    entry = Search.of("samples", (), here.cost, cheapest.cost, best is cheapest)
    return scorer.scored(model, solve_fast(model, best.pose, scorer.blocks, scorer.active_dofs, 0)), entry


def _blocks(scorer: PoseScorer, held: PosePrior) -> list[ResidualBlock]:
    """Return the residual blocks with a prior in place of the prediction."""
    return [scorer.residuals, held, *scorer.priors[1:]]


def _samples(model: BodyModel, pose: Array, scorer: PoseScorer, sigma: Array, draw: int = 0) -> Sequence[Array]:
    """Return poses drawn around a pose, (n_values,) each."""
    free = np.flatnonzero(np.ones(model.n_dofs, dtype=bool) if scorer.active_dofs is None else scorer.active_dofs)
    blocks = _blocks(scorer, PosePrior(pose, 1 / sigma))
    around = solve_fast(model, pose, blocks, scorer.active_dofs, 0)
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
