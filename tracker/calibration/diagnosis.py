"""Find the cameras whose calibration the contours contradict, and the corrections that mend them.

A correction of one kind of one camera is a hypothesis. With poses and sizes eliminated, one of gradient b and Hessian S
lowers the cost by 1/2 b^T S^-1 b. The best are fitted, the best of these is kept if it is worth it, and
the evidence is selected again by the corrected cameras, until no hypothesis is worth keeping (forward selection).
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.acquisition.size_parameters import SizeParameters
from tracker.calibration.camera_correction import KINDS, N_CORRECTIONS, with_step
from tracker.calibration.rig_problem import RigProblem, RigState
from tracker.calibration.seen_frames import SeenFrame, seen_people
from tracker.compute.progress import Report, unreported
from tracker.compute.threads import one_blas_thread
from tracker.fitting.bundle import solve_bundle
from tracker.fitting.hypothesis import CLEAR_NATS
from tracker.geometry.arrays import Array

ROTATION_SIGMA, POSITION_SIGMA_M, FOCAL_SIGMA, TIME_SIGMA_FRAMES = float(np.radians(1.0)), 0.05, 0.01, 1.0
"""Standard deviations of the corrections of a camera in their prior."""
WORTH_NATS = 4.0
"""Fall of the cost, for each number that a hypothesis corrects, from which it is kept."""
_CAMERAS_FITTED, _KINDS_FITTED = 2, 2
"""Number of cameras, and of kinds of each, that are fitted before one is kept: the most promising ones."""
_BEGINNINGS = 3
"""Largest number of cameras that the selection begins with."""
_MOST = 8
"""Largest number of hypotheses that are kept."""
_STEPS = 8
"""Largest number of Gauss-Newton steps of a fit; the next goes on from there."""


def prior_sigmas(fps: float) -> Array:
    """Return the standard deviations of a correction in its prior, (N_CORRECTIONS,), at a number of frames per
    second."""
    return np.array(
        [ROTATION_SIGMA] * 3 + [POSITION_SIGMA_M] * 3 + [FOCAL_SIGMA, TIME_SIGMA_FRAMES / fps], dtype=np.float64
    )


class Hypothesis(NamedTuple):
    """A kind of correction of one camera."""

    camera: int
    kind: str
    """A key of `KINDS`."""

    @property
    def columns(self) -> NDArray[np.int64]:
        """Its places among the corrections of all cameras, one after the other."""
        return self.camera * N_CORRECTIONS + np.arange(N_CORRECTIONS)[KINDS[self.kind]]


class Kept(NamedTuple):
    """A hypothesis that was kept."""

    hypothesis: Hypothesis
    gain_nats: float
    """Fall of the cost by it."""
    rivals: tuple[Hypothesis, ...]
    """Hypotheses that explained the contours as well when it was kept."""


class Step(NamedTuple):
    """The correction that a hypothesis promises, from the linearized problem."""

    correction: Array
    """Of its camera, (N_CORRECTIONS,), with those that were kept."""
    sigma: Array
    """Standard deviations of the numbers that it corrects, else 0, (N_CORRECTIONS,)."""
    gain_nats: float
    """Fall of the cost."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What contours say of the cameras."""

    corrections: Array
    """That mend the cameras, (V, N_CORRECTIONS); 0 where nothing is off."""
    covariance: Array
    """Of those that are not 0, whatever poses and sizes are, (V * N_CORRECTIONS, V * N_CORRECTIONS)."""
    kept: tuple[Kept, ...]
    """Hypotheses in the order in which they were kept."""
    steps: Mapping[Hypothesis, "Step"]
    """Of each hypothesis that was not kept, the correction that it would make."""
    state: RigState
    """Cameras, sizes and poses that fit the contours."""

    @property
    def named(self) -> tuple[int, ...]:
        """Indices of the cameras that are off, the worst first."""
        return tuple(dict.fromkeys(k.hypothesis.camera for k in self.kept))

    def sigmas(self, camera: int) -> Array:
        """Return the standard deviations of the correction of a camera, (N_CORRECTIONS,)."""
        at = slice(camera * N_CORRECTIONS, (camera + 1) * N_CORRECTIONS)
        return np.asarray(np.sqrt(np.diag(self.covariance)[at]))


def diagnose(
    frames: Sequence[SeenFrame], parameters: Sequence[SizeParameters], fps: float, report: Report = unreported
) -> Diagnosis:
    """Find the cameras that are off.

    Args:
        frames: people on frames of diverse poses, as they were tracked with the present cameras.
        parameters: sizes of each person's body, around the body of the frames.
        fps: frames per second.
        report: shows progress. An exception that it raises ends the diagnosis.
    """
    n_views = len(frames[0].views)
    state = RigState(
        np.zeros((n_views, N_CORRECTIONS)), tuple(np.zeros(len(p.names)) for p in parameters),
        tuple(b.values for f in frames for b in f.bodies),
    )  # fmt: skip
    search = _Search(frames, parameters, prior_sigmas(fps))
    report("fitting poses to the contours", 0.0)
    start = search.fitted(state, (), accepts=False)
    state = search.fitted(start.state, ()).state
    best, tried = search.selected(state, (), partial(report, "judging the cameras")), set[int]()
    # One camera that is off can look like two others that are: begin with other cameras as well.
    while len(best.cameras) > 1 and len(tried) < _BEGINNINGS:
        tried |= {k.hypothesis.camera for k in best.kept[:1]}
        other = search.selected(state, tried, partial(report, "judging the cameras"))
        if not other.kept:
            break
        tried.add(other.kept[0].hypothesis.camera)
        best = min(best, other, key=lambda s: search.total(start.problem, s))
    report("done", 1.0)
    steps = _steps(best.fit, [k.hypothesis for k in best.kept])
    return Diagnosis(best.fit.state.corrections, _covariance(best.fit), best.kept, steps, best.fit.state)


class _Fitted(NamedTuple):
    """A rig that was fitted."""

    problem: RigProblem
    state: RigState
    cost: float
    hessian: Array
    """Of the shared unknowns, whatever the poses are, (n, n)."""
    gradient: Array
    """By them, (n,)."""
    free: NDArray[np.bool_]
    """Which of them were fitted, (n,)."""


class _Selection(NamedTuple):
    """Hypotheses that were kept, and the rig that they give."""

    kept: tuple[Kept, ...]
    fit: _Fitted

    @property
    def cameras(self) -> set[int]:
        """Indices of the cameras that are off."""
        return {k.hypothesis.camera for k in self.kept}


class _Search:
    """Fits the rig of some frames with various corrections free."""

    def __init__(self, frames: Sequence[SeenFrame], parameters: Sequence[SizeParameters], sigmas: Array) -> None:
        self._frames, self._parameters, self._sigmas = frames, parameters, sigmas

    def selected(self, state: RigState, not_first: Collection[int], report: Callable[[float], None]) -> _Selection:
        """Keep hypotheses one by one until none is worth it; the first is not of some cameras, given by index."""
        kept = list[Kept]()
        while True:
            report(len(kept) / _MOST)
            chosen = [k.hypothesis for k in kept]
            fit = self.fitted(state, chosen)
            found = self.best(fit, chosen, not_first if not kept else ()) if len(kept) < _MOST else None
            if found is None:
                return self.without_idle(fit, kept)
            kept.append(found[0])
            state = found[1]

    def total(self, problem: RigProblem, selection: _Selection) -> float:
        """Return the cost of a selection on the evidence of a problem, with the worth that its hypotheses need."""
        hypotheses = [k.hypothesis for k in selection.kept]
        return self.refitted(problem, selection.fit.state, hypotheses).cost + sum(map(_needed, hypotheses))

    def fitted(self, state: RigState, chosen: Collection[Hypothesis], accepts: bool = True) -> _Fitted:
        """Fit poses, sizes and chosen corrections, on the evidence that the state accepts or on all."""
        seen = seen_people(self._frames, state if accepts else None)
        problem = RigProblem(seen, self._parameters, self._sigmas, state.corrections)
        return self.refitted(problem, state, chosen)

    def refitted(self, problem: RigProblem, state: RigState, chosen: Collection[Hypothesis]) -> _Fitted:
        """Fit poses, sizes and chosen corrections on the evidence of a problem."""
        free = np.zeros(state.corrections.size, np.bool_)
        for h in chosen:
            free[h.columns] = True
        problem = problem.with_free(free.reshape(state.corrections.shape))
        found = solve_bundle(problem, state, _STEPS)
        shared, own = problem.free(found.state, found.equations)
        every = np.concatenate([np.ones(free.size, np.bool_), shared[free.size :]])
        with one_blas_thread():
            gradient, hessian = found.equations.held(every, own).reduced()
        return _Fitted(problem, found.state, found.cost, hessian, gradient, shared)

    def best(
        self, fit: _Fitted, chosen: Collection[Hypothesis], without: Collection[int]
    ) -> tuple[Kept, RigState] | None:
        """Fit the most promising hypotheses; return the best with its state, or None if none is worth it.

        Args:
            fit: the rig so far.
            chosen: hypotheses that were kept.
            without: indices of cameras that are not tried.
        """
        steps = {h: s for h, s in _steps(fit, chosen).items() if h.camera not in without}
        promise = {h: s.gain_nats - _needed(h) for h, s in steps.items() if s.gain_nats > _needed(h)}
        promising = sorted(promise, key=lambda h: -promise[h])
        cameras = list(dict.fromkeys(h.camera for h in promising))[:_CAMERAS_FITTED]
        tried = [h for c in cameras for h in [p for p in promising if p.camera == c][:_KINDS_FITTED]]
        fits = {h: self.refitted(fit.problem, fit.state, {*chosen, h}) for h in tried}
        worth = {h: fit.cost - found.cost - _needed(h) for h, found in fits.items()}
        best = max(worth, key=lambda h: worth[h], default=None)
        if best is None or worth[best] <= 0:
            return None
        rivals = [h for h in worth if h != best and worth[h] > worth[best] - CLEAR_NATS]
        return Kept(best, fit.cost - fits[best].cost, tuple(rivals)), fits[best].state

    def without_idle(self, fit: _Fitted, kept: Sequence[Kept]) -> _Selection:
        """Drop hypotheses that later ones have made superfluous; return the others with their fit."""
        for candidate in list(kept):
            others = [k for k in kept if k is not candidate]
            if not any(k.hypothesis.camera == candidate.hypothesis.camera for k in others):
                continue
            state = fit.state._replace(corrections=fit.state.corrections.copy())
            state.corrections.ravel()[candidate.hypothesis.columns] = 0.0
            found = self.refitted(fit.problem, state, [k.hypothesis for k in others])
            if found.cost - fit.cost < _needed(candidate.hypothesis):
                kept, fit = others, found
        return _Selection(tuple(kept), fit)


def _needed(hypothesis: Hypothesis) -> float:
    """Return the fall of the cost from which a hypothesis is kept, nats."""
    return WORTH_NATS * len(hypothesis.columns)


def _steps(fit: _Fitted, chosen: Collection[Hypothesis]) -> dict[Hypothesis, Step]:
    """Return the correction that each further hypothesis promises."""
    base, out = np.flatnonzero(fit.free), {}
    H_base = fit.hessian[np.ix_(base, base)]
    for camera, present in enumerate(fit.state.corrections):
        for kind, own in KINDS.items():
            h = Hypothesis(camera, kind)
            if h in chosen:
                continue
            across = fit.hessian[np.ix_(h.columns, base)]
            solved = np.linalg.solve(H_base, np.column_stack([across.T, fit.gradient[base]]))
            covariance = np.linalg.inv(fit.hessian[np.ix_(h.columns, h.columns)] - across @ solved[:, :-1])
            b = fit.gradient[h.columns] - across @ solved[:, -1]
            step, sigma = np.zeros(N_CORRECTIONS), np.zeros(N_CORRECTIONS)
            step[own], sigma[own] = -covariance @ b, np.sqrt(np.diag(covariance))
            out[h] = Step(with_step(present, step), sigma, 0.5 * float(b @ covariance @ b))
    return out


def _covariance(fit: _Fitted) -> Array:
    """Return the covariance of the fitted corrections, whatever sizes and poses are, in the places of all."""
    n, base = fit.state.corrections.size, np.flatnonzero(fit.free)
    out = np.zeros((n, n))
    at = base[base < n]
    out[np.ix_(at, at)] = np.linalg.inv(fit.hessian[np.ix_(base, base)])[: len(at), : len(at)]
    return out
