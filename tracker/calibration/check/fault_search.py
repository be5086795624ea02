"""Fit a rig with more and more corrections free: the faults that explain the contours best (forward selection)."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.calibration.check.judged_frames import JudgedFrame, seen_people
from tracker.calibration.check.lens_priors import CALIBRATED
from tracker.compute.threads import one_blas_thread
from tracker.estimation.acquisition.contour_bundle import ContourBundle, RigState
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations, BundleFit, settle_bundle, solve_bundle
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import KINDS, N_CORRECTIONS, with_step


class _Prior(NamedTuple):
    """Standard deviations of a camera's corrections."""

    rotation_rad: float
    position_m: float
    focal: float
    time_frames: float
    drift: float


PRIOR = _Prior(CALIBRATED.rotation_rad, CALIBRATED.shift_m, CALIBRATED.focal, time_frames=1.0, drift=0.01)
"""A tripod that is knocked, a zoom that is touched, a camera that starts a frame late or loses one frame in a hundred.
It fixes the gauge where several cameras are corrected; of one camera, contours say a hundred times as much."""
WORTH_NATS = 4.0
"""Fall of the cost, for each number that a fault corrects, from which it is taken for real. A number that fits noise
gains half a nat, and one of 20,000 pixels is worth 4.8 nats by the Bayesian information criterion (Schwarz 1978), of as
many as are independent some 4. Two faults that differ by less than they need explain the contours equally well."""


class _Effort(NamedTuple):
    """Bounds of the search."""

    cameras: int
    """Most promising cameras that are fitted before a fault is taken."""
    kinds: int
    """Kinds of faults of each that are fitted."""
    beginnings: int
    """Cameras that the selection may begin with."""
    faults: int
    """Most faults that are taken."""
    heat: int
    """Gauss-Newton steps after which faults that cannot be the best any more are left out."""
    steps: int
    """Gauss-Newton steps of a fit; the next goes on from there."""


EFFORT = _Effort(cameras=2, kinds=2, beginnings=3, faults=8, heat=2, steps=8)
"""With one camera fitted, a camera opposite the one that is off was blamed on one of nine recordings."""

LEAST_GAIN = 0.5
"""Fall of the cost that a further step must promise, nats: as much as a number gains that fits noise."""


def prior_sigmas(fps: float) -> Array:
    """Return the standard deviations of a correction in its prior, (N_CORRECTIONS,), at a number of frames per
    second."""
    return np.array(
        [PRIOR.rotation_rad] * 3 + [PRIOR.position_m] * 3 + [PRIOR.focal, PRIOR.time_frames / fps, PRIOR.drift],
        dtype=np.float64,
    )


class Fault(NamedTuple):
    """A kind of correction of one camera."""

    camera: int
    kind: str
    """A key of `KINDS`."""

    @property
    def columns(self) -> NDArray[np.int64]:
        """Its places among the corrections of all cameras, one after the other."""
        return self.camera * N_CORRECTIONS + np.arange(N_CORRECTIONS)[KINDS[self.kind]]


class FoundFault(NamedTuple):
    """A fault that was kept."""

    fault: Fault
    gain_nats: float
    """Fall of the cost by it."""
    rivals: Mapping[Fault, Array]
    """Faults that explained the contours as well when it was kept, and the correction of their camera by each,
    (N_CORRECTIONS,)."""


class Step(NamedTuple):
    """The correction that a fault promises, from the linearized problem."""

    correction: Array
    """Of its camera, (N_CORRECTIONS,), with those that were kept."""
    sigma: Array
    """Standard deviations of the numbers that it corrects, else 0, (N_CORRECTIONS,)."""
    gain_nats: float
    """Fall of the cost."""


def as_tracked(frames: Sequence[JudgedFrame], parameters: Sequence[SizeParameters]) -> RigState:
    """Return the poses of the frames, in the bodies and by the cameras that they were tracked with."""
    return RigState(
        np.zeros((len(frames[0].views), N_CORRECTIONS)), tuple(np.zeros(len(p.names)) for p in parameters),
        tuple(b.values for f in frames for b in f.bodies),
    )  # fmt: skip


class FittedRig(NamedTuple):
    """A rig that was fitted."""

    problem: ContourBundle
    state: RigState
    equations: ArrowEquations
    """Normal equations there; they are the same whatever is free."""
    hessian: Array
    """Of the shared unknowns, whatever the poses are, (n, n)."""
    gradient: Array
    """By them, (n,)."""
    free: NDArray[np.bool_]
    """Which of them were fitted, (n,)."""

    @property
    def cost(self) -> float:
        """Cost of the state."""
        return self.equations.cost

    @property
    def promise(self) -> float:
        """Fall of the cost that a further step promises."""
        at = np.flatnonzero(self.free)
        return 0.5 * float(self.gradient[at] @ np.linalg.solve(self.hessian[np.ix_(at, at)], self.gradient[at]))


class Selection(NamedTuple):
    """Faults that were kept, and the rig that they give."""

    kept: tuple[FoundFault, ...]
    fit: FittedRig

    @property
    def cameras(self) -> set[int]:
        """Indices of the cameras that are off."""
        return {k.fault.camera for k in self.kept}


class FaultSearch:
    """Fits the rig of some frames with various corrections free."""

    def __init__(self, frames: Sequence[JudgedFrame], parameters: Sequence[SizeParameters], sigmas: Array) -> None:
        self._frames, self._parameters, self._sigmas = frames, parameters, sigmas

    def begun(self) -> FittedRig:
        """Fit the poses as they were tracked roughly, on all evidence."""
        return self.fitted(as_tracked(self._frames, self._parameters), (), accepts=False, steps=EFFORT.heat)

    def selected(self, state: RigState, not_first: Collection[int], report: Callable[[float], None]) -> Selection:
        """Keep faults one by one until none is worth it; the first is not of some cameras, given by index."""
        kept = list[FoundFault]()
        while True:
            report(len(kept) / EFFORT.faults)
            chosen = [k.fault for k in kept]
            fit = self.fitted(state, chosen)
            found = self.best(fit, chosen, not_first if not kept else ()) if len(kept) < EFFORT.faults else None
            if found is None:
                return self.without_idle(fit, kept)
            kept.append(found[0])
            state = found[1].state

    def total(self, problem: ContourBundle, selection: Selection) -> float:
        """Return the cost of a selection on the evidence of a problem, with the worth that its faults need."""
        faults = [k.fault for k in selection.kept]
        return self._solved(problem, selection.fit.state, faults).cost + sum(map(_needed, faults))

    def fitted(
        self, state: RigState, chosen: Collection[Fault], accepts: bool = True, steps: int = EFFORT.steps
    ) -> FittedRig:
        """Fit poses, sizes and chosen corrections, on the evidence that the state accepts or on all."""
        return self._solved(self._problem(state, chosen, accepts), state, chosen, steps)

    def _problem(self, state: RigState, chosen: Collection[Fault], accepts: bool = True) -> ContourBundle:
        """Return the problem of the evidence that a state accepts, or of all, in which chosen corrections are free."""
        seen = seen_people(self._frames, state if accepts else None)
        return ContourBundle(seen, self._parameters, state.corrections, self._sigmas).with_free(_columns(chosen))

    def settled(self, selection: Selection) -> Selection:
        """Fit the faults of a selection to where the gradient vanishes, on the evidence that its state accepts."""
        if not selection.kept:
            return selection
        state = selection.fit.state
        problem = self._problem(state, [k.fault for k in selection.kept])
        found = settle_bundle(problem, state, EFFORT.steps, LEAST_GAIN)
        return selection._replace(fit=fitted_rig(problem, found))

    def refitted(self, fit: FittedRig, chosen: Collection[Fault], steps: int = EFFORT.steps) -> FittedRig:
        """Fit poses, sizes and chosen corrections on the same evidence further, in some Gauss-Newton steps at most."""
        return self._solved(fit.problem, fit.state, chosen, steps, fit.equations)

    def _solved(
        self, problem: ContourBundle, state: RigState, chosen: Collection[Fault], steps: int = EFFORT.steps,
        known: ArrowEquations | None = None,
    ) -> FittedRig:  # fmt: skip
        problem = problem.with_free(_columns(chosen))
        return fitted_rig(problem, solve_bundle(problem, state, steps, least_gain=LEAST_GAIN, known=known))

    def best(
        self, fit: FittedRig, chosen: Collection[Fault], without: Collection[int]
    ) -> tuple[FoundFault, FittedRig] | None:
        """Fit the most promising faults; return the best with its fit, or None if none is worth it.

        A clock that is followed is tried whatever it promises: contours match other edges on the way, so that a fit
        gained 31 nats where a step promised 4. For the same reason a fault must be worth it by its size, too.

        Args:
            fit: the rig so far.
            chosen: faults that were kept.
            without: indices of cameras that are not tried.
        """
        steps = {h: s for h, s in further_steps(fit, chosen).items() if h.camera not in without}
        promise = {
            h: s.gain_nats - _needed(h)
            for h, s in steps.items()
            if s.gain_nats > _needed(h) or is_repeated_clock_fault(self._frames, h.camera, (h.kind,))
        }
        promising = sorted(promise, key=lambda h: -promise[h])
        cameras = list(dict.fromkeys(h.camera for h in promising))[: EFFORT.cameras]
        tried = [h for c in cameras for h in [p for p in promising if p.camera == c][: EFFORT.kinds]]
        fits = self._raced(fit, {h: {*chosen, h} for h in tried})
        worth = {h: min(fit.cost - f.cost, _nats_of_size(f, h)) - _needed(h) for h, f in fits.items()}
        best = max(worth, key=lambda h: worth[h], default=None)
        if best is None or worth[best] <= 0:
            return None
        close = [h for h in worth if h != best and worth[h] > worth[best] - _needed(best)]
        rivals = {h: fits[h].state.corrections[h.camera] for h in close}
        return FoundFault(best, fit.cost - fits[best].cost, rivals), fits[best]

    def _raced(self, fit: FittedRig, faults: Mapping[Fault, Collection[Fault]]) -> dict[Fault, FittedRig]:
        """Fit each fault with those that go with it; not to the end where it cannot become the best or a rival."""
        fits = {h: self.refitted(fit, chosen, EFFORT.heat) for h, chosen in faults.items()}
        # Of the best so far, the cost from which a fault is no rival of it.
        _, least = min(((f.cost + _needed(h), f.cost + 2 * _needed(h)) for h, f in fits.items()), default=(0.0, 0.0))
        return {
            h: self.refitted(f, faults[h]) if f.cost + _needed(h) - f.promise < least else f for h, f in fits.items()
        }

    def without_idle(self, fit: FittedRig, kept: Sequence[FoundFault]) -> Selection:
        """Drop faults that later ones have made superfluous; return the others with their fit."""
        for candidate in list(kept):
            others = [k for k in kept if k is not candidate]
            if not any(k.fault.camera == candidate.fault.camera for k in others):
                continue
            state = fit.state._replace(corrections=fit.state.corrections.copy())
            state.corrections.ravel()[candidate.fault.columns] = 0.0
            found = self._solved(fit.problem, state, [k.fault for k in others])
            if found.cost - fit.cost < _needed(candidate.fault):
                kept, fit = others, found
        return Selection(tuple(kept), fit)


def _columns(faults: Collection[Fault]) -> NDArray[np.int64]:
    """Return the places of faults among the corrections of all cameras."""
    return np.concatenate([np.zeros(0, np.int64), *(h.columns for h in faults)])


def fitted_rig(problem: ContourBundle, found: BundleFit[RigState]) -> FittedRig:
    """Return a rig that was fitted, with the poses eliminated."""
    shared, own = problem.free(found.state, found.equations)
    n = found.state.corrections.size
    every = np.concatenate([np.ones(n, np.bool_), shared[n:]])
    with one_blas_thread():
        gradient, hessian = found.equations.held(every, own).reduced()
    return FittedRig(problem, found.state, found.equations, hessian, gradient, shared)


def is_repeated_clock_fault(frames: Sequence[JudgedFrame], camera: int, kinds: Collection[str]) -> bool:
    """Return whether a fault is one of time alone, of a camera whose clock was corrected before.

    Such a fault is followed until it stands: the time is found a little short where people were tracked with the wrong
    one, and no shape of a body looks like it.
    """
    return bool(kinds) and set(kinds) <= {"time", "drift"} and any(f.ahead_s[camera] for f in frames)


def _nats_of_size(fit: FittedRig, fault: Fault) -> float:
    """Return half the squared size of a fitted correction in units of its standard deviations (Wald's test), nats."""
    at = fault.columns
    size = fit.state.corrections.ravel()[at]
    return 0.5 * float(size @ np.linalg.solve(covariance_of(fit)[np.ix_(at, at)], size))


def _needed(fault: Fault) -> float:
    """Return the fall of the cost from which a fault is kept, nats."""
    return WORTH_NATS * len(fault.columns)


def further_steps(fit: FittedRig, chosen: Collection[Fault]) -> dict[Fault, Step]:
    """Return the correction that each further fault promises."""
    base, out = np.flatnonzero(fit.free), {}
    H_base = fit.hessian[np.ix_(base, base)]
    for camera, present in enumerate(fit.state.corrections):
        for kind, own in KINDS.items():
            h = Fault(camera, kind)
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


def covariance_of(fit: FittedRig) -> Array:
    """Return the covariance of the fitted corrections, whatever sizes and poses are, in the places of all."""
    n, base = fit.state.corrections.size, np.flatnonzero(fit.free)
    out = np.zeros((n, n))
    at = base[base < n]
    out[np.ix_(at, at)] = np.linalg.inv(fit.hessian[np.ix_(base, base)])[: len(at), : len(at)]
    return out
