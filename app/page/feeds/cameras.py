"""Updates for the inspector of a page on the cameras: the check of the calibration, and the clocks."""

from collections.abc import Iterable

import numpy as np

from app.drawing.misfit_field import MisfitField
from app.messages.base import made_of
from app.messages.cameras import CalibrationMessage, CameraCheck, CameraClock, ClocksMessage, ComparedMoment, FoundClock
from app.state.calibration import CalibrationState, ClocksState
from tracker.calibration.check.diagnosis import CameraFinding
from tracker.compute.sampling import without_gaps
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import KINDS, in_units
from tracker.pipeline.calibration_check import CalibrationCheck
from tracker.session.session import Session


def calibration(found: CalibrationState, n_people: int, field: MisfitField) -> CalibrationMessage:
    """Describe the check of the cameras.

    Args:
        found: its state.
        n_people: number of people in the session.
        field: see `misfit_field`, of its result.
    """
    check, preview = found.check, found.preview
    rows = () if check is None else tuple(_camera(c, check) for c in check.cameras)
    return made_of(
        CalibrationMessage, found, is_checked=check is not None, cameras=rows,
        frames=() if check is None else check.frames, sentences=() if check is None else tuple(check.sentences),
        misfits=field.arrows, misfit_factor=field.factor, others=found.n_others, better=found.n_better,
        preview_frame=None if preview is None else preview.frame,
        preview_fall_nats=0.0 if preview is None else round(preview.cost_before - preview.cost_after, 1),
        outdated=tuple(_intervals(found.outdated.get(i, ())) for i in range(n_people)),
    )  # fmt: skip


def clocks(session: Session, found: ClocksState) -> ClocksMessage:
    """Describe the clocks of the cameras and the work on them."""
    estimates = {
        f.camera: FoundClock(f.start_frames, None if f.rate is None else 1000 * f.rate, f.sigma_ms, f.is_clear)
        for f in found.found
    }
    cameras = tuple(
        CameraClock(c.start_frames, 1000 * c.clock.rate, estimates.get(c.camera.name)) for c in session.cameras
    )
    at = found.moment
    moment = None if at is None else ComparedMoment(at.frame, found.views, at.centers_px, at.source)
    return made_of(ClocksMessage, found, cameras=cameras, moment=moment)


def _intervals(frames: Iterable[int]) -> tuple[tuple[int, int], ...]:
    """Return the first and last frames of the intervals that frames, ascending, make up."""
    return tuple((int(part[0]), int(part[-1])) for part in without_gaps(frames))


def _camera(found: CameraFinding, check: CalibrationCheck) -> CameraCheck:
    turned, moved, zoomed, shifted, drift = _numbers(found.correction)
    deviations = dict(zip(in_units(found.sigma), _numbers(found.sigma), strict=True))
    rivals = {kind: dict(zip(KINDS, _numbers(c), strict=True))[kind] for kind, c in found.rivals.items()}
    return CameraCheck(
        found.name, found.misfit_px, found.misfit_mm, found.kinds, rivals, turned, moved, zoomed[0], shifted[0],
        drift[0], deviations, check.since.get(found.name), check.n_lost(found.name), found.is_seen,
    )  # fmt: skip


def _numbers(correction: Array) -> list[tuple[float, ...]]:
    """Return the numbers of each kind of a correction, in the units of people and the order of `KINDS`."""
    return [tuple(np.atleast_1d(v).tolist()) for v in in_units(correction).values()]
