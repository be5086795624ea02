"""Check key points against the session: unit, size of the pictures, confidences, agreement of the views."""

from collections.abc import Container, Mapping, Sequence
from itertools import combinations

import numpy as np

from tracker.compute.quantiles import known_median
from tracker.errors import FormatError, Remedy
from tracker.footage.camera_source import CameraSource
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import INLIER_M, Views
from tracker.interchange.observations.observed import ObservedPoints
from tracker.interchange.observations.shifts import SAMPLES, evenly, point_rays, view_shifts

_SIZES = (0.25, 1 / 3, 0.5, 2 / 3, 0.75, 4 / 3, 1.5, 2.0, 3.0, 4.0)
"""Ratios of usual sizes of pictures, such as 1920, 1280 and 640 px of width."""


def picture_problems(tables: Mapping[str, PictureTable], cameras: Mapping[str, Camera]) -> list[FormatError]:
    """Return what contradicts the pictures of the cameras: other sizes, normalized coordinates, no confidences."""
    problems = []
    for name, table in tables.items():
        size = cameras[name].size
        points = table.points[table.is_found]
        if table.size is not None and table.size != size:
            problems.append(_other_size(name, size, f"{table.size[0]}x{table.size[1]} in the file", table.size))
        elif len(points) and np.abs(points[:, :2]).max() <= _MAX_NORMALIZED < min(size) / 4:
            seen = f"coordinates up to {np.abs(points[:, :2]).max():.3g}, which are normalized"
            expected = f"pixels of the {size[0]}x{size[1]} footage"
            problems.append(FormatError.mismatch(f"camera '{name}'", expected, seen, Remedy("scale_normalized")))
        elif len(points):
            outside = ((points[:, :2] < -0.5) | (points[:, :2] > np.array(size) - 0.5)).any(axis=-1)
            if 2 * outside.sum() > len(points):  # a person who is cut off has some there
                reach = np.quantile(points[:, :2], 0.99, axis=0)
                found = f"{outside.mean():.0%} of the points outside of it, as far as {reach[0]:.0f}, {reach[1]:.0f}"
                problems.append(_other_size(name, size, found, None))
        if not table.has_confidence:
            expected = "a confidence for each point"
            problems.append(FormatError.mismatch(f"camera '{name}'", expected, "none", Remedy("say_confidence")))
    return problems


_MAX_NORMALIZED = 2.0
"""Largest coordinate of normalized points, of which 1 is the width or height: some are beyond the picture."""


def _other_size(name: str, size: tuple[int, int], found: str, given: tuple[int, int] | None) -> FormatError:
    text = f"{given[0]}x{given[1]}" if given else "WIDTHxHEIGHT"
    expected = f"key points of the {size[0]}x{size[1]} footage"
    return FormatError.mismatch(f"camera '{name}'", expected, found, Remedy("give_picture_size", size=text))


def agreement_m(points: ObservedPoints, cameras: Sequence[Camera], scale: float = 1.0) -> float:
    """Return the median distance between the viewing rays of a point in two views, metres; NaN with no two views.

    Of several people in a view, those whose rays meet best count. Frames are sampled.

    Args:
        points: key points.
        cameras: of the session, in its order.
        scale: factor of the pixels, to try another size of the pictures.
    """
    views = Views(cameras)
    frames = evenly(points.n_frames, SAMPLES)
    chosen, known = points.points_px[frames] * scale, points.is_known[frames]
    rays = point_rays(views, chosen, known)
    gaps = []
    for a, b in combinations(range(len(cameras)), 2):
        apart = views.ray_distances(a, b, rays[:, a, :, None], rays[:, b, None])  # of each pair of detections
        by_pair = apart.reshape(len(apart), -1, apart.shape[-1])
        medians = known_median(np.moveaxis(by_pair, 2, 0))
        best = np.where(np.isfinite(medians), medians, np.inf).argmin(axis=1)
        gaps.append(by_pair[np.arange(len(best)), best].ravel())
    return float(known_median(np.concatenate(gaps))) if gaps else np.nan


def agreement_problem(points: ObservedPoints, cameras: Sequence[Camera]) -> FormatError | None:
    """Return that the views do not agree, and as which size of the pictures or cameras they would; None if they do.

    Rays of one point that pass each other by more than half a limb's thickness are of different points.
    """
    found = agreement_m(points, cameras)
    if not found > INLIER_M / 2:
        return None
    scaled = {s: agreement_m(points, cameras, s) for s in _SIZES}
    best = min(scaled, key=lambda s: scaled[s])
    hint = ""
    if scaled[best] < INLIER_M / 2:
        width, height = (round(n / best) for n in cameras[0].size)
        hint = f"; as key points of {width}x{height} pictures they would by {100 * scaled[best]:.0f} cm"
    else:
        for a, b in combinations(range(len(cameras)), 2):
            exchanged = agreement_m(_exchanged(points, a, b), cameras)
            if exchanged < INLIER_M / 2:
                hint = f"; with {points.cameras[a]} and {points.cameras[b]} exchanged by {100 * exchanged:.0f} cm"
                break
    seen = f"that half of them pass each other by over {100 * found:.0f} cm{hint}"
    return FormatError.mismatch("", "the viewing rays of a point in two views to meet", seen, Remedy("check_views"))


def timing_problems(
    points: ObservedPoints, cameras: Sequence[CameraSource], fps: float, decided: Container[str]
) -> tuple[list[FormatError], list[str]]:
    """Return the views whose key points lie some frames from those of the others, as problems and as notes.

    Args:
        points: key points.
        cameras: of the session, in its order.
        fps: frames per second.
        decided: cameras whose offset the user has given; a note suffices.
    """
    ahead = [c.clock.offset_frames(points.n_frames // 2) for c in cameras]
    problems, notes = [], []
    for name, n in view_shifts(points, [c.camera for c in cameras], fps, ahead).items():
        later = f"{abs(n)} frame{'s' * (abs(n) != 1)} {'later' if n > 0 else 'earlier'}"
        found = f"those of {later} fit the other views best"
        if name in decided:
            notes.append(f"camera '{name}': of its key points, {found}")
        else:
            expected = "key points that fit the other views on the same frame"
            remedy = Remedy("shift_keypoints", camera=name, frames=str(n))
            problems.append(FormatError.mismatch(f"camera '{name}'", expected, f"that {found}", remedy))
    return problems, notes


def _exchanged(points: ObservedPoints, a: int, b: int) -> ObservedPoints:
    order = np.arange(len(points.cameras))
    order[[a, b]] = b, a
    return ObservedPoints(points.names, points.cameras, points.points_px[:, order], points.confidence[:, order])
