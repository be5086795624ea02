"""Judge corrections of cameras frame by frame: since when a camera is off, and whether a correction helps elsewhere."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.fault_search import EFFORT, LEAST_GAIN, fitted_rig
from tracker.calibration.check.judged_frames import JudgedFrame, seen_people
from tracker.estimation.acquisition.contour_bundle import ContourBundle, RigState
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.bundle import solve_bundle
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_correction import N_CORRECTIONS


class FrameScore(NamedTuple):
    """Cost of a frame and its derivatives by corrections, with the poses at their best."""

    frame: int
    cost: float
    """Half the weighted sum of squares, nats."""
    gradient: Array
    """Derivative of the cost by further corrections of all cameras, (V * N_CORRECTIONS,)."""
    hessian: Array
    """Second derivative, (V * N_CORRECTIONS, V * N_CORRECTIONS)."""
    poses: tuple[Array, ...] = ()
    """Of each person, at their best, (n_values,)."""


def score_frame(
    frame: JudgedFrame, parameters: Sequence[SizeParameters], sizes: Sequence[Array], corrections: Array
) -> FrameScore:
    """Fit the poses of a frame to all contours under given cameras and sizes.

    Args:
        frame: people on the frame.
        parameters: of each person's body.
        sizes: of each person, (n_sizes,).
        corrections: of each camera, (V, N_CORRECTIONS).
    """
    state = RigState(corrections, tuple(sizes), tuple(b.values for b in frame.bodies))
    anything = np.full(N_CORRECTIONS, np.inf)  # no prior of the corrections
    problem = ContourBundle(seen_people([frame]), parameters, corrections, anything, kinds=())
    fit = fitted_rig(problem, solve_bundle(problem, state, EFFORT.steps, least_gain=LEAST_GAIN))
    return FrameScore(frame.frame, fit.cost, fit.gradient, fit.hessian, fit.state.poses)


class Change(NamedTuple):
    """The frame from which on a correction explains the contours best."""

    first: int
    """Index of the first score from which on the camera is off; 0 if it always is."""
    gain_nats: float
    """Fall of the cost against a camera that is off on all frames, or that never changes."""
    is_confirmed: bool = True
    """Whether enough frames before it and after it say so: as many as the gain has nats to reach, because one bad frame
    may have any gain."""


def find_change(
    scores: Sequence[tuple[FrameScore, FrameScore]], camera: int, columns: IntArray, correction: Array, sigmas: Array
) -> Change:
    """Find since when a camera is off, by the likelihood of each frame (a change point; Page 1954).

    The best correction of some frames is near that of all: there the cost is a parabola, but at the present camera it
    is none if a body moves by more than contours reach.

    Args:
        scores: of frames in order, with the present camera, and with the correction of all frames.
        camera: index of the camera.
        columns: indices of the numbers that are corrected, (n,), within those of a camera.
        correction: of all frames, (N_CORRECTIONS,).
        sigmas: standard deviations of corrections in their prior, (N_CORRECTIONS,).
    """
    at, c = camera * N_CORRECTIONS + columns, correction[columns]
    prior = np.diag(1 / sigmas[columns] ** 2)

    def from_each_on(values: Sequence[Array] | Sequence[float]) -> Array:
        return np.asarray(np.cumsum(np.asarray(values)[::-1], axis=0)[::-1])

    falls = from_each_on([before.cost - after.cost for before, after in scores]) - 0.5 * c @ prior @ c
    b = from_each_on([after.gradient[at] for _, after in scores]) + prior @ c
    S = from_each_on([after.hessian[np.ix_(at, at)] for _, after in scores]) + prior
    gains = [
        float(fall + 0.5 * g @ np.linalg.solve(H, g)) for fall, g, H in zip(falls, b, S, strict=True)
    ]  # fmt: skip
    first = int(np.argmax(gains))
    gain = gains[first] - gains[0]
    # The best of n frames gains ln n more by chance than a frame that was named before.
    needed = CLEAR_NATS + np.log(len(scores))
    if gain <= needed:
        return Change(0, gain)
    return Change(first, gain, min(first, len(scores) - first) >= int(needed))
