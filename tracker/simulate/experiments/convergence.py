"""Convergence of the minimization: in the paper's modes (KRH08 Fig. 13), in the default mode, and from a rough guess by
incremental pose estimation (Fig. 9)."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.by_frame.frame_problem import prior_blocks
from tracker.estimation.by_frame.settings import TOLERANCE
from tracker.estimation.contour.fit_steps import (
    FitIteration,
    fit_by_iterations,
    fit_incrementally,
    paper_residuals,
    rms_at,
    unlimited_views,
)
from tracker.estimation.contour.paper import paper_settings
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import iterate
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.simulate.experiments.contour_run import Scene
from tracker.simulate.experiments.staged_views import StagedObserver

Mode = Literal["paper", "paper, no sliding", "default"]
MODES: tuple[Mode, ...] = ("paper", "paper, no sliding", "default")
"""How a frame is fitted: in the paper's mode with and without the sliding term, and in the default mode."""
MAX_ITERATIONS = 15
MIN_GAIN = 0.01
"""Relative decrease of the RMS distance below which an iteration is the last that counts."""
_EVERY = 5
"""Every so many frames is fitted."""
BACK = (1, 4)
"""Numbers of frames by which a start pose lies in the past."""
ROUGH_RAD, ROUGH_M = float(np.radians(15)), 0.1
"""Errors of the rough guess: standard deviation of each angle and of each coordinate of the root, rad and metres."""


class TracedFit(NamedTuple):
    """A fit of one frame."""

    rms_px: tuple[float, ...]
    """RMS distance of the contours before the first iteration and after each one, px."""

    @property
    def iterations(self) -> int:
        """Number of iterations."""
        return len(self.rms_px) - 1


class Convergence(NamedTuple):
    """Fits of some frames from true poses of earlier frames."""

    back: int
    """Number of frames between the start pose and the frame that is fitted."""
    mode: Mode
    fits: tuple[TracedFit, ...]

    @property
    def rms_px(self) -> Array:
        """RMS distance of each fit after each iteration, (n_fits, MAX_ITERATIONS + 1), px; its last once it has
        ended."""
        return np.array([[*f.rms_px, *[f.rms_px[-1]] * (MAX_ITERATIONS + 1 - len(f.rms_px))] for f in self.fits])

    @property
    def mean_iterations(self) -> float:
        """Mean number of iterations."""
        return float(np.mean([f.iterations for f in self.fits]))


class RoughStep(NamedTuple):
    """A step of the incremental fit of a rough guess."""

    name: str
    """What moved."""
    rms_px: float
    """RMS distance of the contours after it, px."""
    off_m: float
    """Mean distance of the body's points from the true ones after it, metres."""


def measure_convergence(scene: Scene, seed: int = 0) -> tuple[Convergence, ...]:
    """Fit every fifth frame of a scene from true poses of earlier frames, in every mode.

    Args:
        scene: of a body of elliptical cones.
        seed: of the noise.
    """
    observer = StagedObserver(scene.actor, scene.truth, scene.cameras, scene.noise_px, seed)
    found: dict[tuple[int, Mode], list[TracedFit]] = {(back, mode): [] for back in BACK for mode in MODES}
    for k in range(min(max(BACK), len(scene.truth) - 1), len(scene.truth), _EVERY):
        for back, mode in found:
            start = scene.truth[max(k - back, 0)]
            found[back, mode].append(_traced([*_iterations(scene.model, start, observer.evidence(k), mode)]))
    return tuple(Convergence(back, mode, tuple(fits)) for (back, mode), fits in found.items())


def _iterations(model: BodyModel, start: Array, views: Sequence[ViewEvidence], mode: Mode) -> Iterator[FitIteration]:
    """Fit a frame from a pose. Yields the start and each iteration, with the distances of the paper's mode."""
    paper, body = paper_settings("edges", mode == "paper"), PosedBody(model, start)
    distances = paper_residuals(unlimited_views(views, paper), [body], 0, paper)
    if mode != "default":
        yield from fit_by_iterations(model, start, distances, MAX_ITERATIONS)
        return
    settings = ContourSettings()
    priors = prior_blocks(model, start, np.where(model.dof_is_length, settings.trust_m, settings.trust_rad))
    contours = ContourResiduals(views, [body], settings=settings.match, everywhere=True)
    for fit in iterate(model, start, [contours, *priors], max_iterations=MAX_ITERATIONS, tolerance=TOLERANCE):
        yield rms_at(model, fit.pose, distances, f"iteration {fit.iterations}")


def fit_from_guess(scene: Scene, seed: int = 0) -> tuple[tuple[RoughStep, ...], tuple[RoughStep, ...]]:
    """Fit the first frame of a scene from a rough guess: chain by chain, and all degrees of freedom at once.

    Args:
        scene: of a body of elliptical cones.
        seed: of the guess and the noise.

    Returns:
        The steps of each fit, the start first. Of the fit at once there is one step.
    """
    model, truth, rng = scene.model, scene.truth[0], np.random.default_rng([seed, 9])
    step = np.where(model.dof_is_length, ROUGH_M, ROUGH_RAD) * rng.normal(size=model.n_dofs)
    start, settings = model.move(truth, step), paper_settings("edges")
    observer = StagedObserver(scene.actor, scene.truth, scene.cameras, scene.noise_px, seed)
    unlimited = unlimited_views(observer.evidence(0), settings)
    residuals = paper_residuals(unlimited, [PosedBody(model, start)], 0, settings)
    true_world = model.points_world(truth)

    def measured(i: FitIteration, name: str) -> RoughStep:
        off = np.linalg.norm(model.points_world(i.pose) - true_world, axis=1)
        return RoughStep(name, i.rms_px, float(off.mean()))

    steps = tuple(measured(i, i.name) for i in fit_incrementally(model, start, residuals))
    *_, last = fit_by_iterations(model, start, residuals, settings.max_iterations)
    return steps, (steps[0], measured(last, "all at once"))


def _traced(iterations: list[FitIteration]) -> TracedFit:
    """Return the iterations up to the first that gains little, that one included."""
    rms = [iterations[0].rms_px]
    for before, i in pairwise(iterations):
        rms.append(i.rms_px)
        if i.rms_px > (1 - MIN_GAIN) * before.rms_px:
            break
    return TracedFit(tuple(rms))
