"""Cameras that a person has calibrated, and how well they are determined: alike for key points and silhouettes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.expected_error import MAX_POINTS, VolumeAccuracy, expected_error
from tracker.calibration.boards.rig_fit import TOLD_FOCAL
from tracker.calibration.check.held_out import HeldOut
from tracker.calibration.check.lens_priors import NEWS, UNKNOWN_LENS
from tracker.calibration.check.point_problem import PointProblem, require_spread, triangulate_all
from tracker.calibration.check.rig_adjustment import Prior, Rig, plain_errors_px
from tracker.calibration.self_calibration.joint_adjustment import (
    AdjustedJoints,
    Gauge,
    UnknownLenses,
    adjust_joints,
    no_common_view,
)
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.calibration.self_calibration.stature import Upright
from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import IntArray
from tracker.geometry.cameras import Camera
from tracker.geometry.same_place import INLIER_M


class Identified(NamedTuple):
    """People who were recognized in the pictures."""

    names: tuple[str, ...]
    n_left_out: int = 0
    """Number of pictures that show people, of whom nobody was used."""
    n_exchanged: int = 0
    """Number of times that a file gives a person the name of another."""


ONE_PERSON = Identified(("person",))
"""Somebody without a name."""


@dataclass(frozen=True, eq=False)
class PersonCalibration:
    """Cameras that joints of a person, or points of their silhouettes, have calibrated."""

    world: Upright
    """The cameras in a world with z up, and the joints: a row for each person on each frame."""
    adjusted: AdjustedJoints
    """The adjustment of all frames, in a world of its own."""
    seen: SeenJoints
    """Joints of the frames that were used, with sides mended."""
    held_out: HeldOut
    """Observations on those of them that a first adjustment left out."""
    volume: VolumeAccuracy
    """Error of triangulated joints, without that of the scale."""
    scale_sigma: float
    """Standard deviation of the scale, as a share of it."""
    notes: tuple[str, ...]
    """Sentences on quantities that the footage does not determine."""
    points: str = "joints"
    """Name of the points in the pictures."""
    identified: Identified = ONE_PERSON
    """The people whose points they are."""

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The calibrated cameras."""
        return self.world.cameras


def of_one_size(cameras: Sequence[Camera]) -> tuple[tuple[int, ...], ...]:
    """Return the indices of cameras with pictures of one size, whose lenses are taken for alike."""
    sizes = dict.fromkeys(c.size for c in cameras)
    return tuple(tuple(i for i, c in enumerate(cameras) if c.size == size) for size in sizes)


def adjusted_to(
    cameras: Sequence[Camera],
    seen: SeenJoints,
    gauge: Gauge,
    lenses: UnknownLenses | None,
    failure: Callable[[], CalibrationError] = no_common_view,
) -> AdjustedJoints:
    """Fit cameras and joints.

    Raises:
        CalibrationError: cameras do not see them from different sides, which is the `failure`, or at too little spread.
    """
    found = adjust_joints(cameras, seen.observations(), seen.n_joints, gauge, lenses)
    if found is None:
        raise failure()
    require_spread(found.fit.rig, found.observed)
    return found


def held_out_errors(cameras: Sequence[Camera], frames: IntArray, seen: SeenJoints) -> HeldOut:
    """Return the errors of joints on frames that cameras were not fitted to.

    Joints are triangulated by plain least squares; nothing else moves.
    """
    observations = seen.observations()
    points, determined = triangulate_all(cameras, observations)
    observed = observations.of_groups(determined)
    if not len(observed.px):
        return HeldOut(frames, observed.cameras, np.zeros(0))
    problem = PointProblem(observed, Prior.held(cameras), int(determined.sum()), np.ones(len(cameras)))
    errors = plain_errors_px(problem, Rig(tuple(cameras), points[determined]))
    return HeldOut(frames, observed.cameras, np.linalg.norm(errors, axis=1))


def volume_error(adjusted: AdjustedJoints, scale: float) -> VolumeAccuracy:
    """Return the expected error of joints, metres; the scale has an error of its own."""
    points = adjusted.points_world[np.isfinite(adjusted.points_world).all(axis=1)]
    few = points[spread_indices(len(points), MAX_POINTS)]
    error = expected_error(adjusted.cameras, adjusted.fit.covariance, few, with_scale=False)
    return VolumeAccuracy(*(scale * e for e in error))


def require_determined(
    volume: VolumeAccuracy, adjusted: AdjustedJoints, seen: SeenJoints, scale: float, points: str = "joints"
) -> None:
    """Refuse unknown focal lengths, and cameras by which a joint could be taken for another one."""
    for camera, sigma in zip(adjusted.cameras, adjusted.fit.focal_sigmas, strict=True):
        if sigma > NEWS * UNKNOWN_LENS.focal:
            raise CalibrationError(
                f"expected {points} that show the focal length of camera '{camera.name}', found it not determined by "
                f"this footage (+- {sigma:.0%}); {advice(len(adjusted.cameras))}"
            )
    if volume.expected_m < INLIER_M:
        return
    joints = scale * seen.by_joint(adjusted.points_world)
    middles = np.nanmedian(joints[np.isfinite(joints).any(axis=(1, 2))], axis=1)
    way = np.linalg.norm(np.ptp(middles, axis=0)) if len(middles) else 0.0
    evidence = "key points" if points == "joints" else points
    raise CalibrationError(
        f"expected {evidence} that determine the cameras to {1000 * INLIER_M:.0f} mm, found an error of "
        f"{1000 * volume.expected_m:.0f} mm to be expected from {len(seen.px)} frames in which the person moves over "
        f"{way:.1f} m; {advice(len(adjusted.cameras))}"
    )


def undetermined(n_cameras: int) -> CalibrationError:
    """Return the error of silhouettes that do not determine cameras."""
    return CalibrationError(f"expected silhouettes that determine the cameras, found none that do; {advice(n_cameras)}")


def advice(n_cameras: int) -> str:
    """Return how to film so that cameras are determined."""
    more = ", or add a camera: two alone hardly tell their focal lengths" if n_cameras == 2 else ""
    return (
        "let the person walk through the volume, turn, and move arms and legs before cameras that stand at an angle to "
        f"each other, or give the lenses{more}"
    )


def lens_notes(adjusted: AdjustedJoints, has_lenses: bool) -> tuple[str, ...]:
    """Return sentences on what was assumed of the lenses, and what the joints do not tell."""
    if has_lenses:
        return ()
    out = ["principal points in the middle, no distortion and one focal length for pictures of one size were assumed"]
    for camera, sigma in zip(adjusted.cameras, adjusted.fit.focal_sigmas, strict=True):
        if sigma > TOLD_FOCAL:
            out.append(f"camera '{camera.name}': the joints do not tell its focal length better than to {sigma:.1%}")
    return tuple(out)


def scale_notes(stature_m: float | None, sigma: float) -> tuple[str, ...]:
    """Return sentences on how certain the scale is, by a stature and its standard deviation as a share."""
    if stature_m is None:
        return (
            f"no height was given: the scale is that of a person of {DEFAULT_HEIGHT_M} m and may be off by "
            f"{100 * sigma:.0f}%, one standard deviation of adult statures and proportions (ANSUR II)",
        )
    return (
        f"the scale follows from the height by typical proportions and may be off by {100 * sigma:.0f}%, one standard "
        "deviation",
    )
