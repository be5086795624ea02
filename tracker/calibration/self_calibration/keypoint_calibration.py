"""From key points of people to calibrated cameras, and what they are worth on frames that were held out.

Find views that are mirrored, or whose files exchange left and right: cameras fit them at a wrong place.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.calibration.boards.board_calibration import FLAT_SHARE
from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.boards.view_choice import MAX_FRAMES, MAX_LENS_VIEWS
from tracker.calibration.check.held_out import held_out_of
from tracker.calibration.check.point_problem import triangulate_all
from tracker.calibration.check.rig_adjustment import Observations
from tracker.calibration.check.unsolvable import check_apart
from tracker.calibration.self_calibration.camera_chain import pose_before_joints
from tracker.calibration.self_calibration.identification import Statures, first_cameras
from tracker.calibration.self_calibration.joint_adjustment import UnknownLenses
from tracker.calibration.self_calibration.person_calibration import (
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
from tracker.calibration.self_calibration.rival_cameras import Solution, require_one_solution
from tracker.calibration.self_calibration.stature import (
    Upright,
    metres_by_person,
    metres_per_unit,
    scale_sigma,
    upright,
)
from tracker.compute.progress import Report, stages, unreported
from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.checks import view_shifts
from tracker.interchange.observations.observed import ObservationSet

LEAST_FPS = 25.0
"""Frame rate of footage that states none, such as folders of images, 1/s."""


def calibrate_by_person(
    observations: ObservationSet,
    cameras: Sequence[Camera],
    statures_m: Statures = None,
    has_lenses: bool = False,
    report: Report = unreported,
    fps: float = LEAST_FPS,
) -> PersonCalibration:
    """Calibrate cameras by key points of people who move before them.

    Args:
        observations: key points in pictures.
        cameras: with their lenses, or with lenses as they are on average.
        statures_m: of the people by name, or of each, metres; None for those of typical adults.
        has_lenses: whether the lenses are known.
        report: receives the progress.
        fps: frames per second; views may lag by up to two seconds.

    Raises:
        CalibrationError: the key points do not determine the cameras; the message says what is missing.
    """
    try:
        return _calibrated(observations, cameras, statures_m, has_lenses, report, fps)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"expected key points that determine the cameras, found none that do; {advice(len(cameras))}"
        ) from error


def _calibrated(
    observations: ObservationSet,
    cameras: Sequence[Camera],
    statures_m: Statures,
    has_lenses: bool,
    report: Report,
    fps: float,
) -> PersonCalibration:
    chaining, adjusting, checking = stages(report, "chain of cameras", "all cameras", "frames held out")
    cameras = [replace(c, T_world_camera=np.eye(4)) for c in cameras]
    lenses = None if has_lenses else UnknownLenses(tuple(cameras), of_one_size(cameras))
    first = first_cameras(_spread(observations), cameras, statures_m, lenses)
    seen, gauge, statures = first.seen, first.gauge, first.statures_m
    chaining(1.0)
    held_out = held_out_of(np.arange(len(seen.px)))
    rest = seen.on_frames(np.setdiff1d(np.arange(len(seen.px)), held_out))
    before = adjusted_to(first.cameras, rest, gauge, lenses)
    adjusting(0.5)
    adjusted = adjusted_to(before.cameras, seen, gauge, lenses)
    adjusting(1.0)
    errors = held_out_errors(before.cameras, held_out, seen.on_frames(held_out))
    checking(1.0)
    joints = seen.by_joint(adjusted.points_world)
    scale = metres_per_unit(joints, seen.names, statures)
    volume = volume_error(adjusted, scale)
    _require_in_step(observations, scaled_cameras(adjusted.cameras, scale), fps)
    require_determined(volume, adjusted, seen, scale)
    _require_motion(scale * joints, float(np.nanmean(statures)))
    require_unmirrored(adjusted.cameras, adjusted.observed, adjusted.sigma_px)
    require_one_solution(Solution(adjusted, gauge), first.rivals, seen, lenses)
    by_person = scale * joints.reshape(-1, len(seen.names), 3)
    world = upright(scaled_cameras(adjusted.cameras, scale), by_person, seen.names, float(np.nanmean(statures)))
    check_apart(world.cameras)
    scales = metres_by_person(joints, seen.names, statures)
    given = None if statures_m is None else float(np.nanmean(statures))
    sigma = scale_sigma(given, int(np.isfinite(scales).sum()))
    notes = (*scale_notes(given, sigma), *_people_notes(scales), *lens_notes(adjusted, has_lenses), _up_note(world))
    return PersonCalibration(
        world, adjusted, seen, errors, volume, sigma, (*notes, *first.notes), identified=first.identified
    )  # fmt: skip


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
    chosen = _spread_over(frames, (points.is_known.any(axis=3).sum(axis=2) == 1).sum(axis=1)[frames] > 1)
    tracks = None if points.tracks is None else points.tracks[chosen]
    few = replace(points, points_px=points.points_px[chosen], confidence=points.confidence[chosen], tracks=tracks)
    return replace(observations, points=few, row_frames=(chosen.astype(np.float64),))


def _spread_over(frames: IntArray, is_alone: Mask) -> IntArray:
    """Return at most `MAX_FRAMES` frames, with enough of those on which people are alone for first cameras."""
    alone, crowded = frames[is_alone], frames[~is_alone]
    n = min(len(alone), max(MAX_LENS_VIEWS, MAX_FRAMES * len(alone) // len(frames)))
    some = (alone[spread_indices(len(alone), n)], crowded[spread_indices(len(crowded), MAX_FRAMES - n)])
    return np.sort(np.concatenate(some))


def _require_in_step(observations: ObservationSet, cameras: Sequence[Camera], fps: float) -> None:
    """Refuse views that lag: cameras hide a lag, as they fit it at wrong places."""
    assert observations.points is not None
    if late := view_shifts(observations.points, cameras, fps):
        found = ", ".join(
            f"camera '{c}' with those of {abs(n)} {'later' if n > 0 else 'earlier'}" for c, n in late.items()
        )
        offsets = ", ".join(f"{n} for '{c}'" for c, n in late.items())
        raise CalibrationError(
            f"expected key points of all cameras to fit on the same frame, found that they fit best with other frames: "
            f"{found}; start the videos at the same instant, or give these offsets: {offsets}"
        )


def _require_motion(joints: Array, stature_m: float) -> None:
    """Refuse people who stand still, by their joints, (F, n, 3), metres: errors of a detector then stay the same."""
    seen = joints[:, np.isfinite(joints).all(axis=2).any(axis=0)]
    apart = np.linalg.norm(seen - np.nanmedian(seen, axis=0), axis=2)
    moved_m = float(np.nanmedian(apart, axis=0).max())
    if moved_m < FLAT_SHARE * stature_m:
        raise CalibrationError(
            f"expected a person in many places and postures, found that half of the time each joint is within "
            f"{100 * moved_m:.1g} cm of one place; let the person walk through the volume, turn, and move arms and legs"
        )


def _people_notes(scales: Array) -> tuple[str, ...]:
    """Return a sentence on how far the scales by several people, (n_people,), differ."""
    known = scales[np.isfinite(scales)]
    if len(known) < 2:
        return ()
    return (f"the heights of {len(known)} people give scales that differ by {known.max() / known.min() - 1:.0%}",)


def _up_note(world: Upright) -> str:
    lean = f"{np.degrees(world.lean_rad):.0f} degrees"
    return (
        f"up is the direction from the ankles to the shoulders, from which single frames differ by {lean}: a person "
        f"who leans tilts the floor; it was found by the {world.floor_by}"
    )


def require_unmirrored(cameras: Sequence[Camera], observed: Observations, sigma_px: float) -> None:
    """Check that no view agrees better with the joints of the other cameras if it is mirrored.

    A person seen from the front looks much like one who is seen from behind in a mirrored picture. Left as it is, such
    a view puts its camera on the other side, with errors that look small.

    Args:
        cameras: the calibrated cameras; of two, the other one alone finds no joints.
        observed: places of joints; some are grossly wrong.
        sigma_px: standard deviation of the others.

    Raises:
        CalibrationError: there is one.
    """
    mirrored = []
    for i, camera in enumerate(cameras):
        is_own = observed.cameras == i
        rest = replace(observed, cameras=observed.cameras[~is_own], groups=observed.groups[~is_own],
                       px=observed.px[~is_own])  # fmt: skip
        if len(np.unique(rest.cameras)) < 2:
            continue
        points, determined = triangulate_all(cameras, rest)
        own = is_own & (observed.groups < len(points))
        own[own] = determined[observed.groups[own]]
        px, joints = observed.px[own], points[observed.groups[own]]
        turned = np.array([camera.width - 1, 0]) + px * np.array([-1, 1])
        as_is, as_mirrored = (_misfit(camera, p, joints, sigma_px) for p in (px, turned))
        # Mirrored views spoil the joints of all, and gain a fifth; true ones lose as much. From afar both fit to 4%.
        if 1.1 * as_mirrored < as_is:
            mirrored.append(repr(camera.name))
    if mirrored:
        raise CalibrationError(
            f"expected key points that all cameras see alike, found that those of camera {' or '.join(mirrored)} agree "
            "better with the others if they are mirrored; check that its footage is not mirrored, and that left and "
            "right are not exchanged in its files"
        )


def _misfit(camera: Camera, px: Array, joints: Array, sigma_px: float) -> float:
    """Return the median distance of joints from their rays, as slopes, at the best pose of a camera; inf without."""
    rays = camera.rays(px) @ camera.T_world_camera[:3, :3]
    ahead = np.isfinite(rays).all(axis=1) & (rays[:, 2] > 0)
    rays, joints = rays[ahead], joints[ahead]
    slopes = rays[:, :2] / rays[:, 2:]
    T_camera_world = pose_before_joints(joints, slopes, sigma_px / float(camera.K[0, 0])) if len(joints) > 5 else None
    if T_camera_world is None:
        return np.inf
    seen = rigid.apply(T_camera_world, joints)
    return float(np.median(np.linalg.norm(seen[:, :2] / seen[:, 2:] - slopes, axis=1)))
