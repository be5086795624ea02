"""From silhouettes of a person to calibrated cameras, and what they are worth on frames that were held out."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.boards.view_choice import MAX_FRAMES
from tracker.calibration.check.held_out import held_out_of
from tracker.calibration.check.point_problem import triangulate_all
from tracker.calibration.check.unsolvable import check_apart
from tracker.calibration.self_calibration.frontier_adjustment import adjust_frontier
from tracker.calibration.self_calibration.frontier_points import frontier_points
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses
from tracker.calibration.self_calibration.person_calibration import (
    PersonCalibration,
    held_out_errors,
    lens_notes,
    of_one_size,
    require_determined,
    scale_notes,
    undetermined,
    volume_error,
)
from tracker.calibration.self_calibration.person_silhouettes import Flaw, PersonSilhouette, UprightRules
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.calibration.self_calibration.silhouette_chain import (
    EFFORT,
    SeenSilhouettes,
    fitted_to_frontier,
    silhouette_chains,
)
from tracker.calibration.self_calibration.stature import STATURE_SIGMA, upright_by_ends
from tracker.compute.progress import Report, stages, unreported
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.compute.sampling import spread_indices
from tracker.compute.threads import one_blas_thread
from tracker.errors import CalibrationError
from tracker.evidence.voxels.figure_masks import STRAY
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera

_REMEDIES: Mapping[Flaw, str] = {
    Flaw.NOBODY: "film the person where the cameras see the same place",
    Flaw.CUT: "keep the whole person in the pictures, with room around",
    Flaw.SEVERAL: "film one person, or leave the others out of the masks",
}


def calibrate_by_silhouettes(
    silhouettes: Sequence[Sequence[PersonSilhouette]],
    cameras: Sequence[Camera],
    stature_m: float | None = None,
    has_lenses: bool = False,
    report: Report = unreported,
) -> PersonCalibration:
    """Calibrate cameras by silhouettes of one person who moves before them, and stands upright on some frames.

    Args:
        silhouettes: by frame and camera.
        cameras: with their lenses, or with lenses as they are on average.
        stature_m: of the person, metres; None for that of a typical adult.
        has_lenses: whether the lenses are known.
        report: receives the progress.

    Raises:
        CalibrationError: the silhouettes do not determine the cameras; the message says what is missing.
    """
    try:
        with one_blas_thread():
            return _calibrated(silhouettes, cameras, stature_m, has_lenses, report)
    except np.linalg.LinAlgError as error:
        raise undetermined(len(cameras)) from error


def _calibrated(
    silhouettes: Sequence[Sequence[PersonSilhouette]],
    cameras: Sequence[Camera],
    stature_m: float | None,
    has_lenses: bool,
    report: Report,
) -> PersonCalibration:
    chaining, adjusting, checking = stages(report, "chain of cameras", "all cameras", "frames held out")
    cameras = [replace(c, T_world_camera=np.eye(4)) for c in cameras]
    _require_shared(silhouettes, cameras)
    seen = _on_shared_frames(silhouettes)
    lenses = None if has_lenses else UnknownLenses(tuple(cameras), of_one_size(cameras))
    placed, gauge = _placed(seen, cameras, lenses)
    chaining(1.0)
    n_frames = len(seen.hulls_px)
    held_out = held_out_of(np.arange(n_frames))
    rest = seen.on_frames(np.setdiff1d(np.arange(n_frames), held_out))
    before, _ = adjust_frontier(placed, rest.hulls_px, gauge, lenses, EFFORT.rounds + 1)
    adjusting(0.5)
    adjusted, points = adjust_frontier(before.cameras, seen.hulls_px, gauge, lenses, EFFORT.rounds + 1)
    adjusting(1.0)
    on_them = frontier_points(seen.on_frames(held_out).hulls_px, before.cameras).seen
    errors = held_out_errors(before.cameras, held_out, on_them)
    checking(1.0)
    found, determined = triangulate_all(adjusted.cameras, seen.standing.observations())
    ends = seen.standing.by_joint(np.where(determined[:, None], found, np.nan))
    statures = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    statures = statures[np.isfinite(statures)]
    if not len(statures):
        raise undetermined(len(cameras))
    scale = (DEFAULT_HEIGHT_M if stature_m is None else stature_m) / float(np.median(statures))
    volume = volume_error(adjusted, scale)
    if not volume.expected_m < DEFAULT_HEIGHT_M:
        raise undetermined(len(cameras))  # beyond the size of a person, the error is no measure
    require_determined(volume, adjusted, points, scale, "silhouettes")
    sigma = _scale_sigma(statures, stature_m)
    world = upright_by_ends(
        scaled_cameras(adjusted.cameras, scale), scale * ends, scale * points.by_joint(adjusted.points_world)
    )
    check_apart(world.cameras)
    notes = (*scale_notes(stature_m, sigma), *_lens_notes(adjusted, has_lenses), _up_note(world.lean_rad))
    notes += under_floor_notes(world.joints_world)
    return PersonCalibration(world, adjusted, points, errors, volume, sigma, notes, "frontier points")


def under_floor_notes(points_world: Array) -> tuple[str, ...]:
    """Return a sentence on points of a person under the floor, as silhouettes of a mirrored view or another time give.

    Args:
        points_world: in a world with z up and its origin on the floor, (..., 3), metres; NaN where there are none.
    """
    z = points_world[..., 2][np.isfinite(points_world[..., 2])]
    # One point in fifty may be wrong; a step or a wrong floor is not as deep.
    lowest_m = float(np.quantile(z, STRAY)) if z.size else 0.0
    if lowest_m > -0.25:
        return ()
    return (
        f"points of the person lie {-lowest_m:.1f} m under the floor: check that all silhouettes are of one person and "
        "one instant, and that no view is mirrored",
    )


def _require_shared(silhouettes: Sequence[Sequence[PersonSilhouette]], cameras: Sequence[Camera]) -> None:
    """Check that each camera shows the whole person alone on frames on which another does, too."""
    counts = np.array([[len(s.hull_px) > 0 for s in row] for row in silhouettes])
    for i, camera in enumerate(cameras):
        n = int((counts[:, i] & np.delete(counts, i, axis=1).any(axis=1)).sum())
        if n >= MIN_SHARED:
            continue
        flaws = Counter(s.flaw for row in silhouettes for s in row if s.flaw in _REMEDIES)
        own = Counter(row[i].flaw for row in silhouettes if row[i].flaw in _REMEDIES) or flaws
        reasons = ", ".join(f"{count} {flaw}" for flaw, count in own.most_common() if flaw)
        worst = own.most_common(1)[0][0] if own else Flaw.NOBODY
        assert worst is not None
        raise CalibrationError(
            f"expected one whole person in camera '{camera.name}' together with another camera on at least "
            f"{MIN_SHARED} frames, found {n}{f' (of its silhouettes, {reasons})' if reasons else ''}; "
            f"{_REMEDIES[worst]}"
        )


def _on_shared_frames(silhouettes: Sequence[Sequence[PersonSilhouette]]) -> SeenSilhouettes:
    """Return the silhouettes on at most `MAX_FRAMES` frames, spread over those that two cameras show."""
    shared = np.flatnonzero([sum(len(s.hull_px) > 0 for s in row) > 1 for row in silhouettes])
    rows = [silhouettes[k] for k in shared[spread_indices(len(shared), MAX_FRAMES)]]
    px = np.array([[s.upright_px for s in row] for row in rows])
    standing = SeenJoints(("", ""), px, np.asarray(np.isfinite(px).all(axis=-1)))
    return SeenSilhouettes(standing, [[s.hull_px for s in row] for row in rows])


def _placed(
    seen: SeenSilhouettes, cameras: Sequence[Camera], lenses: UnknownLenses | None
) -> tuple[tuple[Camera, ...], Gauge]:
    """Place the cameras by a few frames: of the likely chains, the one that fits best with its focal lengths."""
    standing = np.flatnonzero(seen.standing.is_seen.all(axis=-1).sum(axis=1) > 1)
    if len(standing) < MIN_SHARED:
        raise CalibrationError(
            f"expected the person upright in two cameras on at least {MIN_SHARED} frames, found {len(standing)}; let "
            "the person also walk upright, arms down: it shows the vertical"
        )
    few = seen.on_frames(standing[spread_indices(len(standing), EFFORT.frames)])
    best = None
    for chain in silhouette_chains(few, cameras):
        placed = [chain.placed[i] for i in range(len(cameras))]
        distances = [float(np.linalg.norm(c.center_world - placed[0].center_world)) for c in placed]
        gauge = Gauge(0, int(np.argmax(distances)))
        found = fitted_to_frontier(placed, few, gauge, EFFORT.rounds, lenses)
        if found is not None and (best is None or found.sigma_px < best[0].sigma_px):
            best = found, gauge
    if best is None:
        raise undetermined(len(cameras))
    return best[0].cameras, best[1]


def _scale_sigma(statures: Array, stature_m: float | None) -> float:
    """Return the standard deviation of the scale as a share of it.

    Statures differ from frame to frame, as the person bends and steps. Both ends of a silhouette lie beside crown and
    soles besides, alike on all frames: a camera from above sees the tip of the nearer foot.
    """
    spread = MAD_TO_SIGMA * float(np.median(np.abs(statures / np.median(statures) - 1)))
    ends = np.sqrt(2) * UprightRules().end
    return float(np.linalg.norm([spread, ends, STATURE_SIGMA if stature_m is None else 0.0]))


def _lens_notes(adjusted: AdjustedJoints, has_lenses: bool) -> tuple[str, ...]:
    """Return sentences on lenses, of which silhouettes show more than joints do."""
    assumed = (
        "principal points near the middle, little distortion and one focal length for pictures of one size were assumed"
    )
    return () if has_lenses else (assumed, *lens_notes(adjusted, has_lenses)[1:])


def _up_note(lean_rad: float) -> str:
    return (
        f"up is the direction from the feet to the crown, from which single frames differ by "
        f"{np.degrees(lean_rad):.0f} degrees: a person who leans tilts the floor"
    )
