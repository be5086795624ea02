"""From key points of a person to calibrated cameras, and what they are worth on frames that were held out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.boards.camera_graph import MIN_SHARED
from tracker.boards.expected_error import MAX_POINTS, VolumeError, expected_error
from tracker.boards.lens_fit import TOLD_FOCAL
from tracker.boards.rig_fit import HELD_OUT_EVERY, PLAIN_PX
from tracker.boards.view_choice import MAX_FRAMES, MAX_LENS_VIEWS
from tracker.calibration.camera_columns import n_columns
from tracker.calibration.lens_priors import UNKNOWN_LENS
from tracker.calibration.point_adjustment import NEWS, PointProblem, require_spread, triangulate_all
from tracker.calibration.reprojection import FINAL, Observations, Prior, Rig
from tracker.compute.progress import Report, stages, unreported
from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError
from tracker.fitting.bundle import solve_bundle
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.observations.observed import ObservationSet
from tracker.observations.triangulation import INLIER_M
from tracker.self_calibration.camera_chain import chain_cameras
from tracker.self_calibration.joint_adjustment import (
    AdjustedJoints,
    Gauge,
    UnknownLenses,
    adjust_joints,
    among,
    no_common_view,
)
from tracker.self_calibration.seen_joints import SeenJoints, lone_person, with_sides_mended
from tracker.self_calibration.stature import Upright, metres_per_unit, scale_sigma, scaled_by, upright


@dataclass(frozen=True, eq=False)
class PersonCalibration:
    """Cameras that key points of a person have calibrated."""

    world: Upright
    """The cameras in a world with z up, and the joints."""
    adjusted: AdjustedJoints
    """The adjustment of all frames, in a world of its own."""
    seen: SeenJoints
    """Joints of the frames that were used, with sides mended."""
    held_out: IntArray
    """Which of them a first adjustment left out, for `held_out_px`."""
    held_out_cameras: IntArray
    """Camera of each observation on them, (N,)."""
    held_out_px: Array
    """Distance of each of these to the projection of its triangulated joint, (N,), px."""
    volume: VolumeError
    """Error of triangulated joints, without that of the scale."""
    scale_sigma: float
    """Standard deviation of the scale, as a share of it."""
    notes: tuple[str, ...]
    """Sentences on quantities that the footage does not determine."""

    def held_out_rms_px(self, camera: int | None = None) -> float:
        """Return the root mean square error on the frames held out, of one camera or all; NaN without joints."""
        px = self.held_out_px if camera is None else self.held_out_px[self.held_out_cameras == camera]
        return float(np.sqrt(np.mean(px**2))) if len(px) else float("nan")

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The calibrated cameras."""
        return self.world.cameras


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
            f"expected key points that determine the cameras, found none that do; {_advice(len(cameras))}"
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
    lenses = None if has_lenses else UnknownLenses(tuple(cameras), _of_one_size(cameras))
    first = _adjusted(placed, few, gauge, lenses)
    seen = with_sides_mended(observations, seen, _in_metres(first, few, height_m))
    adjusting(0.5)
    held_out = np.arange(len(seen.px))[HELD_OUT_EVERY // 2 :: HELD_OUT_EVERY]
    rest = seen.on_frames(np.setdiff1d(np.arange(len(seen.px)), held_out))
    before = _adjusted(first.cameras, rest, gauge, lenses)
    adjusted = _adjusted(before.cameras, seen, gauge, lenses)
    adjusting(1.0)
    on_them, errors_px = _held_out_errors(before.cameras, seen.on_frames(held_out))
    checking(1.0)
    joints = seen.by_joint(adjusted.points_world)
    scale = metres_per_unit(joints, seen.names, height_m)
    volume = _volume(adjusted, scale)
    _require_determined(volume, adjusted, seen, scale)
    world = upright(scaled_by(adjusted.cameras, scale), scale * joints, seen.names, height_m)
    sigma = scale_sigma(stature_m)
    notes = (*_scale_notes(stature_m, sigma), *_lens_notes(adjusted, has_lenses), *_view_notes(world, n_crowded))
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


def _of_one_size(cameras: Sequence[Camera]) -> tuple[tuple[int, ...], ...]:
    sizes = dict.fromkeys(c.size for c in cameras)
    return tuple(tuple(i for i, c in enumerate(cameras) if c.size == size) for size in sizes)


def _adjusted(
    cameras: Sequence[Camera], seen: SeenJoints, gauge: Gauge, lenses: UnknownLenses | None
) -> AdjustedJoints:
    found = adjust_joints(cameras, seen.observations(), seen.n_joints, gauge, lenses)
    if found is None:
        raise no_common_view()
    numbers, groups = np.unique(found.observed.groups, return_inverse=True)
    require_spread(Rig(found.cameras, found.points_world[numbers]), replace(found.observed, groups=groups))
    return found


def _in_metres(adjusted: AdjustedJoints, seen: SeenJoints, height_m: float) -> tuple[Camera, ...]:
    return scaled_by(adjusted.cameras, metres_per_unit(seen.by_joint(adjusted.points_world), seen.names, height_m))


def _held_out_errors(cameras: Sequence[Camera], seen: SeenJoints) -> tuple[Observations, Array]:
    """Return joints on frames that cameras were not fitted to, and their distances from projections, (N,), px.

    Joints are triangulated by plain least squares; nothing else moves.
    """
    observations = seen.observations()
    points, determined = triangulate_all(cameras, observations)
    observed = among(observations, determined)
    if not len(observed.px):
        return observed, np.zeros(0)
    held = Prior(tuple(cameras), tuple(np.zeros(n_columns(c)) for c in cameras))
    plain = PointProblem(observed, held, int(determined.sum()), np.full(len(cameras), PLAIN_PX))
    rig = solve_bundle(plain, Rig(tuple(cameras), points[determined]), tolerance=FINAL).state
    return observed, np.linalg.norm(plain.errors_px(rig), axis=1)


def _volume(adjusted: AdjustedJoints, scale: float) -> VolumeError:
    """Return the expected error of joints, metres; the scale has an error of its own."""
    points = adjusted.points_world[np.isfinite(adjusted.points_world).all(axis=1)]
    few = points[spread_indices(len(points), MAX_POINTS)]
    error = expected_error(adjusted.cameras, adjusted.fit.covariance, few, with_scale=False)
    return VolumeError(*(scale * e for e in error))


def _require_determined(volume: VolumeError, adjusted: AdjustedJoints, seen: SeenJoints, scale: float) -> None:
    """Refuse unknown focal lengths, and cameras by which a joint could be taken for another one."""
    for camera, sigma in zip(adjusted.cameras, adjusted.focal_sigmas, strict=True):
        if sigma > NEWS * UNKNOWN_LENS.focal:
            raise CalibrationError(
                f"expected joints that show the focal length of camera '{camera.name}', found it not determined by "
                f"this footage (+- {sigma:.0%}); {_advice(len(adjusted.cameras))}"
            )
    if volume.expected_m < INLIER_M:
        return
    joints = scale * seen.by_joint(adjusted.points_world)
    middles = np.nanmedian(joints[np.isfinite(joints).any(axis=(1, 2))], axis=1)
    way = np.linalg.norm(np.ptp(middles, axis=0)) if len(middles) else 0.0
    raise CalibrationError(
        f"expected key points that determine the cameras to {1000 * INLIER_M:.0f} mm, found an error of "
        f"{1000 * volume.expected_m:.0f} mm to be expected from {len(seen.px)} frames in which the person moves over "
        f"{way:.1f} m; {_advice(len(adjusted.cameras))}"
    )


def _advice(n_cameras: int) -> str:
    more = ", or add a camera: two alone hardly tell their focal lengths" if n_cameras == 2 else ""
    return (
        "let the person walk through the volume, turn, and move arms and legs before cameras that stand at an angle to "
        f"each other, or give the lenses{more}"
    )


def _scale_notes(stature_m: float | None, sigma: float) -> tuple[str, ...]:
    if stature_m is None:
        return (
            f"no height was given: the scale is that of a person of {DEFAULT_HEIGHT_M} m and may be off by "
            f"{100 * sigma:.0f}%, one standard deviation of adult statures and proportions (ANSUR II)",
        )
    return (
        f"the scale follows from the height by typical proportions and may be off by {100 * sigma:.0f}%, one standard "
        "deviation",
    )


def _lens_notes(adjusted: AdjustedJoints, has_lenses: bool) -> tuple[str, ...]:
    if has_lenses:
        return ()
    out = ["principal points in the middle, no distortion and one focal length for pictures of one size were assumed"]
    for camera, sigma in zip(adjusted.cameras, adjusted.focal_sigmas, strict=True):
        if sigma > TOLD_FOCAL:
            out.append(f"camera '{camera.name}': the joints do not tell its focal length better than to {sigma:.1%}")
    return tuple(out)


def _view_notes(world: Upright, n_crowded: int) -> tuple[str, ...]:
    lean = f"{np.degrees(world.lean_rad):.0f} degrees"
    out = [
        f"up is the direction from the ankles to the shoulders, from which single frames differ by {lean}: a person "
        f"who leans tilts the floor; it was found by the {world.floor_by}"
    ]
    if n_crowded:
        out.append(f"{n_crowded} pictures show several people and were left out")
    return tuple(out)
