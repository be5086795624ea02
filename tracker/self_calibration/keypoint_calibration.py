"""From key points of a person to calibrated cameras, and what they are worth on frames that were held out."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.boards.camera_graph import MIN_SHARED
from tracker.boards.rig_fit import HELD_OUT_EVERY
from tracker.boards.view_choice import MAX_FRAMES, MAX_LENS_VIEWS
from tracker.compute.progress import Report, stages, unreported
from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.cameras import Camera
from tracker.observations.observed import ObservationSet
from tracker.self_calibration.camera_chain import chain_cameras
from tracker.self_calibration.joint_adjustment import (
    AdjustedJoints,
    UnknownLenses,
)
from tracker.self_calibration.person_calibration import (
    PersonCalibration,
    adjusted_to,
    advice,
    held_out_errors,
    lens_notes,
    of_one_size,
    require_determined,
    scale_notes,
    volume_error,
)
from tracker.self_calibration.seen_joints import SeenJoints, lone_person, with_sides_mended
from tracker.self_calibration.stature import Upright, metres_per_unit, scale_sigma, scaled_by, upright


def calibrate_by_person(
    observations: ObservationSet,
    cameras: Sequence[Camera],
    stature_m: float | None = None,
    has_lenses: bool = False,
    report: Report = unreported,
) -> PersonCalibration:
    """Calibrate cameras by key points of one person who moves before them.

    Args:
        observations: key points in pictures, of one person.
        cameras: with their lenses, or with lenses as they are on average.
        stature_m: of the person, metres; None for that of a typical adult.
        has_lenses: whether the lenses are known.
        report: receives the progress.

    Raises:
        CalibrationError: the key points do not determine the cameras; the message says what is missing.
    """
    try:
        return _calibrated(observations, cameras, stature_m, has_lenses, report)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"expected key points that determine the cameras, found none that do; {advice(len(cameras))}"
        ) from error


def _calibrated(
    observations: ObservationSet, cameras: Sequence[Camera], stature_m: float | None, has_lenses: bool, report: Report
) -> PersonCalibration:
    chaining, adjusting, checking = stages(report, "chain of cameras", "all cameras", "frames held out")
    height_m = DEFAULT_HEIGHT_M if stature_m is None else stature_m
    cameras = [replace(c, T_world_camera=np.eye(4)) for c in cameras]
    observations = _spread(observations)
    seen, n_crowded = lone_person(observations)
    _require_shared(seen, cameras, n_crowded)
    few = seen.on_frames(spread_indices(len(seen.px), MAX_LENS_VIEWS))
    placed, gauge = chain_cameras(few, cameras, height_m)
    chaining(1.0)
    lenses = None if has_lenses else UnknownLenses(tuple(cameras), of_one_size(cameras))
    first = adjusted_to(placed, few, gauge, lenses)
    seen = with_sides_mended(observations, seen, _in_metres(first, few, height_m))
    adjusting(0.5)
    held_out = np.arange(len(seen.px))[HELD_OUT_EVERY // 2 :: HELD_OUT_EVERY]
    rest = seen.on_frames(np.setdiff1d(np.arange(len(seen.px)), held_out))
    before = adjusted_to(first.cameras, rest, gauge, lenses)
    adjusted = adjusted_to(before.cameras, seen, gauge, lenses)
    adjusting(1.0)
    on_them, errors_px = held_out_errors(before.cameras, seen.on_frames(held_out))
    checking(1.0)
    joints = seen.by_joint(adjusted.points_world)
    scale = metres_per_unit(joints, seen.names, height_m)
    volume = volume_error(adjusted, scale)
    require_determined(volume, adjusted, seen, scale)
    world = upright(scaled_by(adjusted.cameras, scale), scale * joints, seen.names, height_m)
    sigma = scale_sigma(stature_m)
    notes = (*scale_notes(stature_m, sigma), *lens_notes(adjusted, has_lenses), *_view_notes(world, n_crowded))
    return PersonCalibration(world, adjusted, seen, held_out, on_them.cameras, errors_px, volume, sigma, notes)


def _spread(observations: ObservationSet) -> ObservationSet:
    """Return the observations on at most `MAX_FRAMES` frames, spread over those on which two cameras show a person."""
    points = observations.points
    assert points is not None
    frames = np.flatnonzero(points.is_known.any(axis=(2, 3)).sum(axis=1) > 1)
    if len(frames) < MIN_SHARED:
        raise CalibrationError(
            f"expected a person in two cameras on at least {MIN_SHARED} frames, found {len(frames)}; film the person "
            "where the cameras see the same place"
        )
    chosen = frames[spread_indices(len(frames), MAX_FRAMES)]
    few = replace(points, points_px=points.points_px[chosen], confidence=points.confidence[chosen])
    return replace(observations, points=few, row_frames=(chosen.astype(np.float64),))


def _require_shared(seen: SeenJoints, cameras: Sequence[Camera], n_crowded: int) -> None:
    """Check that each camera shows joints that others show, too, and that the person is alone."""
    for i, camera in enumerate(cameras):
        others = np.delete(seen.is_seen, i, axis=1).any(axis=1)
        n_frames = int((seen.is_seen[:, i] & others).any(axis=1).sum())
        if n_frames < MIN_SHARED:
            crowded = f"; {n_crowded} pictures show several people and were left out" if n_crowded else ""
            raise CalibrationError(
                f"expected one person in camera '{camera.name}' together with another camera on at least {MIN_SHARED} "
                f"frames, found {n_frames}{crowded}; film one person where they see the same place"
            )


def _in_metres(adjusted: AdjustedJoints, seen: SeenJoints, height_m: float) -> tuple[Camera, ...]:
    return scaled_by(adjusted.cameras, metres_per_unit(seen.by_joint(adjusted.points_world), seen.names, height_m))


def _view_notes(world: Upright, n_crowded: int) -> tuple[str, ...]:
    lean = f"{np.degrees(world.lean_rad):.0f} degrees"
    out = [
        f"up is the direction from the ankles to the shoulders, from which single frames differ by {lean}: a person "
        f"who leans tilts the floor; it was found by the {world.floor_by}"
    ]
    if n_crowded:
        out.append(f"{n_crowded} pictures show several people and were left out")
    return tuple(out)
