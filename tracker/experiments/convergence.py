"""Convergence of single frames: the paper's minimization with and without the sliding term (KRH08 Fig. 13)."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.experiments.contour_run import Scene, contour_rms_px
from tracker.experiments.staged_views import StagedObserver
from tracker.fitting.contour_residuals import ContourResiduals, paper_match
from tracker.fitting.gauss_newton import ResidualBlock
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.geometry.arrays import Array
from tracker.tracking.contour.frame_estimator import NO_LIMIT_PX
from tracker.tracking.contour.image_contours import with_unlimited_distances
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.estimation.settings import TOLERANCE, prior_blocks

Kind = Literal["with sliding", "without sliding", "contour tracker"]
KINDS: tuple[Kind, ...] = ("with sliding", "without sliding", "contour tracker")
"""The paper's minimization, with and without the sliding term; and the residuals and priors of the contour tracker."""
MAX_ITERATIONS = 15
MIN_GAIN = 0.01
"""Relative decrease of the RMS distance below which an iteration is the last."""
ENOUGH_PX = 0.7
"""RMS distance that a fit should reach in 5 iterations, px."""
_EVERY = 5
"""Every so many frames is fitted."""
BACK = (1, 4)
"""Numbers of frames by which a start pose lies in the past."""


class ContourFit(NamedTuple):
    """A fit of one frame."""

    pose: Array
    """(n_values,)."""
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
    kind: Kind
    fits: tuple[ContourFit, ...]

    @property
    def mean_rms_px(self) -> Array:
        """Mean RMS distance after each iteration, (MAX_ITERATIONS + 1,), px; a fit that has ended keeps its last."""
        return np.asarray(np.mean(self._padded, axis=0))

    @property
    def mean_iterations(self) -> float:
        """Mean number of iterations."""
        return float(np.mean([f.iterations for f in self.fits]))

    def share_within(self, iterations: int) -> float:
        """Return the share of the fits that are at `ENOUGH_PX` or nearer after some iterations, 0 to 1."""
        return float(np.mean(self._padded[:, iterations] <= ENOUGH_PX))

    @property
    def _padded(self) -> Array:
        return np.array([[*f.rms_px, *[f.rms_px[-1]] * (MAX_ITERATIONS + 1 - len(f.rms_px))] for f in self.fits])


def measure_convergence(scene: Scene, seed: int = 0) -> tuple[Convergence, ...]:
    """Fit every fifth frame of a scene from true poses of earlier frames.

    Args:
        scene: of a body of elliptical cones.
        seed: of the noise.
    """
    observer = StagedObserver(scene.actor, scene.truth, scene.cameras, scene.noise_px, seed)
    found: dict[tuple[int, Kind], list[ContourFit]] = {(back, kind): [] for back in BACK for kind in KINDS}
    for k in range(min(max(BACK), len(scene.truth) - 1), len(scene.truth), _EVERY):
        views = observer.evidence(k)
        for back, kind in found:
            found[back, kind].append(fit_contours(scene.model, scene.truth[max(k - back, 0)], views, kind))
    return tuple(Convergence(back, kind, tuple(fits)) for (back, kind), fits in found.items())


def fit_contours(model: BodyModel, start: Array, views: Sequence[ViewEvidence], kind: Kind) -> ContourFit:
    """Fit a frame from a start pose, (n_values,), and measure the contours after each iteration.

    The descent begins again for each number of iterations, because it runs in one compiled call.
    """
    blocks, poses = _blocks(model, start, views, kind), [model.clip(start)]
    rms = [contour_rms_px(views, PosedBody(model, poses[0]))]
    while len(rms) <= MAX_ITERATIONS:
        fit = solve_compiled(model, start, blocks, None, len(rms), TOLERANCE)
        if np.array_equal(fit.pose, poses[-1]):
            break
        poses.append(fit.pose)
        rms.append(contour_rms_px(views, PosedBody(model, fit.pose)))
        if rms[-1] > (1 - MIN_GAIN) * rms[-2]:
            break
    return ContourFit(poses[-1], tuple(rms))


def _blocks(model: BodyModel, start: Array, views: Sequence[ViewEvidence], kind: Kind) -> list[ResidualBlock]:
    body, settings = PosedBody(model, start), ContourSettings()
    if kind == "contour tracker":
        sigmas = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)
        return [ContourResiduals(views, [body], 0, settings.match), *prior_blocks(model, start, sigmas)]
    unlimited = [with_unlimited_distances(v, "edges") for v in views]
    match = paper_match("sliding" if kind == "with sliding" else "rigid")
    return [ContourResiduals(unlimited, [body], 0, match, NO_LIMIT_PX, everywhere=True)]
