"""Convergence of the paper's minimization with and without the sliding term (KRH08 Fig. 13)."""

from typing import NamedTuple

import numpy as np

from tracker.experiments.contour_run import Scene
from tracker.experiments.extremal_fit import MAX_ITERATIONS, ExtremalFit, fit_extremal_contours
from tracker.experiments.staged_views import StagedObserver
from tracker.geometry.arrays import Array

_EVERY = 5
"""Every so many frames is fitted."""
BACK = (1, 4)
"""Numbers of frames by which a start pose lies in the past."""


class Convergence(NamedTuple):
    """Fits of some frames from true poses of earlier frames."""

    back: int
    """Number of frames between the start pose and the frame that is fitted."""
    sliding: bool
    fits: tuple[ExtremalFit, ...]

    @property
    def mean_rms_px(self) -> Array:
        """Mean RMS distance after each iteration, (MAX_ITERATIONS + 1,), px; a fit that has ended keeps its last."""
        padded = [[*f.rms_px, *[f.rms_px[-1]] * (MAX_ITERATIONS + 1 - len(f.rms_px))] for f in self.fits]
        return np.asarray(np.mean(padded, axis=0))

    @property
    def mean_iterations(self) -> float:
        """Mean number of iterations."""
        return float(np.mean([f.iterations for f in self.fits]))


def measure_convergence(scene: Scene, seed: int = 0) -> tuple[Convergence, ...]:
    """Fit every fifth frame of a scene from true poses of earlier frames, with and without the sliding term.

    Args:
        scene: of a body of elliptical cones.
        seed: of the noise.
    """
    observer = StagedObserver(scene.actor, scene.truth, scene.cameras, scene.noise_px, seed)
    found: dict[tuple[int, bool], list[ExtremalFit]] = {(back, on): [] for back in BACK for on in (True, False)}
    for k in range(min(max(BACK), len(scene.truth) - 1), len(scene.truth), _EVERY):
        views = observer.evidence(k)
        for back, sliding in found:
            start = scene.truth[max(k - back, 0)]
            found[back, sliding].append(fit_extremal_contours(scene.model, start, views, sliding))
    return tuple(Convergence(back, sliding, tuple(fits)) for (back, sliding), fits in found.items())
