"""Find the cameras whose calibration the contours contradict, and the corrections that mend them.

A correction of one kind of one camera is a fault. With poses and sizes eliminated, one of gradient b and Hessian S
lowers the cost by 1/2 b^T S^-1 b. The best are fitted, the best of these is kept if it is worth it, and
the evidence is selected again by the corrected cameras, until no fault is worth keeping (forward selection).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from tracker.calibration.check.fault_search import (
    EFFORT,
    Fault,
    FaultSearch,
    FoundFault,
    Selection,
    Step,
    as_tracked,
    covariance_of,
    further_steps,
    prior_sigmas,
)
from tracker.calibration.check.viewed_frames import ViewedFrame
from tracker.compute.progress import Report, unreported
from tracker.estimation.acquisition.contour_bundle import RigState
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import N_CORRECTIONS


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Judgement of the contours on all cameras."""

    corrections: Array
    """That mend the cameras, (V, N_CORRECTIONS); 0 where nothing is off."""
    covariance: Array
    """Of those that are not 0, whatever poses and sizes are, (V * N_CORRECTIONS, V * N_CORRECTIONS)."""
    kept: tuple[FoundFault, ...]
    """Faults in the order in which they were kept."""
    steps: Mapping[Fault, "Step"]
    """Of each fault that was not kept, the correction that it would make."""
    state: RigState
    """Cameras, sizes and poses that fit the contours."""

    def sigmas(self, camera: int) -> Array:
        """Return the standard deviations of the correction of a camera, (N_CORRECTIONS,)."""
        at = slice(camera * N_CORRECTIONS, (camera + 1) * N_CORRECTIONS)
        return np.asarray(np.sqrt(np.diag(self.covariance)[at]))


def diagnose(
    frames: Sequence[ViewedFrame], parameters: Sequence[SizeParameters], fps: float, report: Report = unreported
) -> Diagnosis:
    """Find the cameras that are off.

    Args:
        frames: people on frames of diverse poses, as they were tracked with the present cameras.
        parameters: sizes of each person's body, around the body of the frames.
        fps: frames per second.
        report: shows progress. An exception that it raises ends the diagnosis.
    """
    search = FaultSearch(frames, parameters, prior_sigmas(fps))
    report("fitting poses to the contours", 0.0)
    start = search.begun()
    state = search.fitted(start.state, ()).state
    best, tried = search.selected(state, (), partial(report, "judging the cameras")), set[int]()
    # One camera that is off can look like two others that are: begin with other cameras as well.
    while len(best.cameras) > 1 and len(tried) < EFFORT.beginnings:
        tried |= {k.fault.camera for k in best.kept[:1]}
        other = search.selected(state, tried, partial(report, "judging the cameras"))
        if not other.kept:
            break
        tried.add(other.kept[0].fault.camera)
        # As few cameras as possible; of as many, those that explain more.
        best = min(best, other, key=lambda s: (len(s.cameras), search.total(start.problem, s)))
    report("done", 1.0)
    return diagnosis_of(search.settled(best))


def glance(frames: Sequence[ViewedFrame], parameters: Sequence[SizeParameters], fps: float) -> Diagnosis:
    """Find the worst fault by a single choice of evidence: the contours that the tracked poses accept.

    It costs a fraction of `diagnose`, whose arguments it has. The correction comes out too small, because evidence that
    the wrong camera chose holds it back.
    """
    search = FaultSearch(frames, parameters, prior_sigmas(fps))
    fit = search.fitted(as_tracked(frames, parameters), ())
    found = search.best(fit, (), ())
    if found is None:
        return diagnosis_of(Selection((), fit))
    return diagnosis_of(Selection(found[:1], found[1]))


def diagnosis_of(selection: Selection) -> Diagnosis:
    """Return the judgement of a search that kept some faults."""
    fit, kept = selection.fit, selection.kept
    steps = further_steps(fit, [k.fault for k in kept])
    return Diagnosis(fit.state.corrections, covariance_of(fit), kept, steps, fit.state)
