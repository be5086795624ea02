"""Find the cameras whose calibration the contours contradict, and the corrections that mend them.

A correction of one kind of one camera is a fault. With poses and sizes eliminated, one of gradient b and Hessian S
lowers the cost by 1/2 b^T S^-1 b. The best are fitted, the best of these is kept if it is worth it, and
the evidence is selected again by the corrected cameras, until no fault is worth keeping (forward selection).

Findings of a diagnosis on each camera: the correction, its certainty, its effect on the body, and its rivals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

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
    is_repeated_clock_fault,
    prior_sigmas,
)
from tracker.calibration.check.judged_frames import JudgedFrame
from tracker.compute.progress import Report, unreported
from tracker.estimation.acquisition.contour_bundle import RigState
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.footage.camera_source import LostFrames
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import KINDS, N_CORRECTIONS, corrected, later_s


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
    frames: Sequence[JudgedFrame], parameters: Sequence[SizeParameters], fps: float, report: Report = unreported
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


def glance(frames: Sequence[JudgedFrame], parameters: Sequence[SizeParameters], fps: float) -> Diagnosis:
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


WORDS = {
    "rotation": "turned", "position": "moved", "focal": "zoomed", "time": "shifted in time",
    "drift": "drifting in time",
}  # fmt: skip
"""Phrase that describes the fault of a camera, by the kind of its correction."""
SEEN_PX = 1.0
"""Misfit below which a camera is not named, px of the footage. Surfaces of acquired bodies are off by about 1 cm, which
is 1 to 2 px at 4 m: contours cannot distinguish a smaller fault from the shape of the person."""


class CameraFinding(NamedTuple):
    """Judgement of the contours on one camera."""

    name: str
    kinds: tuple[str, ...]
    """Kinds of corrections that mend it, keys of `KINDS`; empty where it is not named."""
    correction: Array
    """That mends it, (N_CORRECTIONS,); 0 where it is not named."""
    sigma: Array
    """Standard deviation of each number that would be corrected, (N_CORRECTIONS,), each kind by itself."""
    misfit_px: float
    """Root mean square distance by which the correction moves the body's points in the picture, px of the footage. Of a
    camera that is not named: by the most likely correction."""
    misfit_mm: float
    """The same at the body, mm."""
    gain_nats: float
    """Fall of the cost by its corrections, or by the most likely one."""
    rivals: Mapping[str, Array]
    """Kinds of corrections of the same camera that explain the contours as well, and the correction by each,
    (N_CORRECTIONS,)."""
    is_seen: bool
    """Whether the camera shows contours of the people at all."""


def findings(diagnosis: Diagnosis, frames: Sequence[JudgedFrame], names: Sequence[str]) -> list[CameraFinding]:
    """Return what a diagnosis says of each camera, in their order."""
    out = []
    for i, name in enumerate(names):
        kept = [k for k in diagnosis.kept if k.fault.camera == i]
        kinds = tuple(dict.fromkeys(k.fault.kind for k in kept))
        likely = max((h for h in diagnosis.steps if h.camera == i), key=lambda h: diagnosis.steps[h].gain_nats)
        correction = diagnosis.corrections[i]
        shown = correction if kinds else diagnosis.steps[likely].correction
        misfit_px, misfit_mm = misfit(frames, i, shown)
        gain = sum(k.gain_nats for k in kept) if kinds else diagnosis.steps[likely].gain_nats
        rivals = {r.kind: c for k in kept for r, c in k.rivals.items() if r.camera == i and r.kind not in kinds}
        named = kinds if misfit_px >= SEEN_PX or is_repeated_clock_fault(frames, i, kinds) else ()
        is_seen = any(len(f.views[i].points_px) for f in frames)
        out.append(
            CameraFinding(
                name, named, correction if named else np.zeros(N_CORRECTIONS), _sigma(diagnosis, i), misfit_px,
                misfit_mm, gain, rivals, is_seen,
            )
        )  # fmt: skip
    return out


def misfit(frames: Sequence[JudgedFrame], camera: int, correction: Array) -> tuple[float, float]:
    """Return the root mean square distance by which a correction moves the body's points in a view.

    Returns:
        Pixels of the footage, and millimetres at the body.
    """
    px, mm = list[Array](), list[Array]()
    for frame in frames:
        view = frame.views[camera].camera
        mended = corrected(view, correction)
        for body, path in zip(frame.bodies, frame.paths, strict=True):
            now, then = (
                body.model.points_world(body.model.retract(body.values, path.step(frame.ahead_s[camera] + delay_s)))
                for delay_s in (0.0, later_s(correction, frame.time_s))
            )
            moved = np.sum((mended.project(then) - view.project(now)) ** 2, axis=-1)
            px.append(moved / frame.views[camera].scale ** 2)
            mm.append(moved * np.asarray(1000 * view.depths(body.points_world) / view.K[0, 0]) ** 2)
    rms_px, rms_mm = (float(np.sqrt(np.nanmean(np.concatenate(squares)))) for squares in (px, mm))
    return rms_px, rms_mm


def _sigma(diagnosis: Diagnosis, camera: int) -> Array:
    """Return the standard deviations of the corrections of a camera, each kind by itself where it was not fitted."""
    out = np.zeros(N_CORRECTIONS)
    for kind, columns in KINDS.items():
        step = diagnosis.steps.get(Fault(camera, kind))
        out[columns] = diagnosis.sigmas(camera)[columns] if step is None else step.sigma[columns]
    return out


def sentence(finding: CameraFinding, since_frame: int | None = None, lost: LostFrames | None = None) -> str:
    """Say how a camera is off, then by how much, then how else it may be off."""
    how = "is " + " and ".join(WORDS[kind] for kind in finding.kinds)
    since = "" if since_frame is None else f" since frame {since_frame}"
    if lost is not None:
        how = f"{'lost' if lost.n > 0 else 'doubled'} {abs(lost.n)} frame{'s' * (abs(lost.n) > 1)}"
        since = f" before frame {lost.since}"
    also = ""
    if finding.rivals:
        also = f"; that it is {' or '.join(WORDS[kind] for kind in finding.rivals)} explains it as well"
    return (
        f"camera {finding.name} {how}{since}: {finding.misfit_px:.1f} px off in its pictures, "
        f"{finding.misfit_mm:.0f} mm at the body{also}"
    )
