"""Check key points against the session: unit, size of the pictures, confidences, agreement and timing of views.

The viewing rays of a point in two views meet if both show the same instant. Their signed distance is taken at all
shifts of one view against the other, without its median over time: that is an offset of detector or calibration. A
shift shows in motion alone.
"""

from collections.abc import Container, Mapping, Sequence
from itertools import combinations

import numpy as np

from tracker.compute.quantiles import known_median
from tracker.errors import FormatError, Remedy
from tracker.footage.camera_source import CameraSource
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import Views
from tracker.geometry.same_place import INLIER_M
from tracker.interchange.observations.observed import ObservedPoints

SAMPLES = 60
"""Largest number of frames that are compared in a stretch, for a median of some thousand distances."""


def view_shifts(
    points: ObservedPoints, cameras: Sequence[Camera], fps: float, ahead: Sequence[float] | None = None
) -> dict[str, int]:
    """Return by how many frames the key points of views are late against most others, up to two seconds.

    A shift is returned only if its view fits those that agree better than without it, and than at twice the shift, in
    each stretch of the recording. Each of them fits best at that shift too, within a frame. If fewer than half of the
    views agree, this must hold against all of them, and shifts are relative to one view. If one view is not clear, none
    is returned. Views that are all shifted together agree, so that nothing shows it.

    Args:
        points: key points.
        cameras: of the session, in its order.
        fps: frames per second.
        ahead: frames by which the picture of each camera is known to be later than its frame; 0 by default.
    """
    margin = min(2 * round(fps), points.n_frames // 4)  # half of the recording can be compared at all shifts
    frames = _moving_frames(points, margin)
    if len(frames) < n_stretches(margin) or len(cameras) < 2:
        return {}
    known = np.round(-np.asarray(ahead if ahead is not None else np.zeros(len(cameras)))).astype(np.int64)
    costs = _pair_costs(points, cameras, frames, margin)
    late = _offsets(costs, known) - known
    late -= _most_common(late)
    agreeing, moved = np.flatnonzero(late == 0).tolist(), np.flatnonzero(late).tolist()
    if 2 * len(agreeing) < len(late):
        agreeing = [*range(len(late))]
    others = {v: [u for u in agreeing if u != v] for v in moved}
    if not all(_is_clear(v, others[v], known + late, known, costs) for v in moved):
        return {}
    return {points.cameras[v]: int(late[v]) for v in moved}


def n_stretches(margin: int) -> int:
    """Return the number of stretches of a recording that must all show a shift.

    Noise favours a shift in a stretch by chance one half, so that none of the shifts that are tried is favoured in all.
    """
    return max(2 * margin, 1).bit_length()


def _moving_frames(points: ObservedPoints, margin: int) -> IntArray:
    """Return frames in which points move, at most `SAMPLES` in a stretch, that lie a margin from both ends.

    Those are the frames whose median step in the pictures is at least half of that in the fastest tenth of all.
    """
    if points.n_frames < 2:
        return np.empty(0, np.int64)
    steps = np.linalg.norm(np.diff(points.points_px[:, :, 0], axis=0), axis=-1).reshape(points.n_frames - 1, -1)
    inner = np.arange(margin, points.n_frames - margin)
    known = np.isfinite(steps).any(axis=1)
    speeds = np.zeros(points.n_frames)
    speeds[1:][known] = np.nanmedian(steps[known], axis=1)
    of_inner = speeds[inner]
    if not len(inner) or not of_inner.any():
        return np.empty(0, np.int64)
    moving = inner[of_inner >= np.quantile(of_inner, 0.9) / 2]
    return moving[evenly(len(moving), SAMPLES * n_stretches(margin))]


def evenly(n: int, most: int) -> IntArray:
    """Return indices of n items, evenly spaced, at most so many."""
    return np.unique(np.linspace(0, n - 1, most).astype(np.int64))


def _pair_costs(
    points: ObservedPoints, cameras: Sequence[Camera], frames: IntArray, margin: int
) -> Mapping[tuple[int, int], Array]:
    """Return the mean truncated squares of the distances of rays, by pair of views, (2 margin + 1, n_stretches).

    The row `margin + s` has the second view s frames later than the first.
    """
    views = Views(cameras)
    rays = point_rays(views, points.points_px, points.is_known)
    costs = {}
    for a, b in combinations(range(len(cameras)), 2):
        baseline = views.centers[b] - views.centers[a]
        first = rays[frames, a]
        across = np.cross(baseline, first)
        found = np.empty((2 * margin + 1, n_stretches(margin)))
        for row in range(len(found)):
            gaps = _gaps(first, across, rays[frames + row - margin, b])
            with np.errstate(invalid="ignore"):
                squares = np.minimum((gaps - known_median(gaps)) / INLIER_M, 1.0)
                squares = np.maximum(squares, -1.0) ** 2
            found[row] = [_mean(block) for block in np.array_split(squares, found.shape[1])]
        costs[a, b] = found
    return costs


def point_rays(views: Views, points_px: Array, known: Mask) -> Array:
    """Return the viewing rays of points, (n_frames, n_views, ..., 3); NaN where absent.

    Args:
        views: the cameras.
        points_px: original pixels, (n_frames, n_views, ..., 2).
        known: whether a point is there, (n_frames, n_views, ...).
    """
    out = np.full((*points_px.shape[:-1], 3), np.nan)
    undistorted = views.undistorted(np.where(known[..., None], points_px, np.nan))
    for v, camera in enumerate(views.cameras):
        out[:, v] = camera.pinhole.rays(undistorted[:, v])
    return out


def _gaps(first: Array, across: Array, second: Array) -> Array:
    """Return the signed distances between rays of the same points, (n_frames, n_points), metres; NaN where unknown.

    Of several people, those whose rays pass nearest are compared.

    Args:
        first: rays of the first view, (n_frames, n_detections, n_points, 3).
        across: their cross products with the baseline.
        second: rays of the second view.
    """
    cosine = np.einsum("fdpi,fepi->fdep", first, second)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        gaps = np.where(sine > 1e-6, np.einsum("fdpi,fepi->fdep", across, second) / sine, np.nan)
    by_pair = gaps.reshape(len(gaps), -1, gaps.shape[-1])
    if by_pair.shape[1] == 1:
        return by_pair[:, 0]
    is_known = np.isfinite(by_pair)
    sums = np.where(is_known, np.minimum(np.abs(by_pair), INLIER_M), 0.0).sum(axis=-1)
    best = np.where(is_known.any(axis=-1), sums / np.maximum(is_known.sum(axis=-1), 1), np.inf).argmin(axis=1)
    return by_pair[np.arange(len(best)), best]


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else np.nan


def _offsets(costs: Mapping[tuple[int, int], Array], known: IntArray) -> IntArray:
    """Return the frame of each view that fits frame 0 of all best.

    Each pair of views has a shift that fits it best. The sum of the distances from these is least; one view moves after
    the other, until none does.
    """
    offsets = known.copy()
    best = {pair: _best_shift(cost) for pair, cost in costs.items()}
    margin = max(len(cost) for cost in costs.values()) // 2
    for _ in range(len(known) * margin):
        before = offsets.copy()
        for v in reversed(range(len(known))):
            tried = [_with(offsets, v, int(known[v]) + s) for s in range(1 - margin, margin)]
            sums = [sum(abs(o[b] - o[a] - s) for (a, b), s in best.items() if v in (a, b)) for o in tried]
            offsets = tried[int(np.argmin(sums))]
        if (offsets == before).all():
            break
    return offsets


def _best_shift(cost: Array) -> float:
    """Return the shift at which a pair of views fits best, between frames by a parabola."""
    curve = np.nan_to_num(cost.mean(axis=1), nan=1.0)
    row, middle = int(curve.argmin()), len(curve) // 2
    return row - middle + vertex(curve[max(row - 1, 0) : row + 2])


def vertex(three: Array) -> float:
    """Return where a parabola through an extreme value and its neighbours is extreme, in steps from the middle one.

    It is 0 for fewer values, at the end of a curve.
    """
    if len(three) < 3:
        return 0.0
    before, here, after = three
    bend = before - 2 * here + after
    return float((before - after) / (2 * bend)) if bend else 0.0


def _with(offsets: IntArray, view: int, value: int) -> IntArray:
    out = offsets.copy()
    out[view] = value
    return out


def _at(curve: Array, pair: tuple[int, int], offsets: IntArray) -> Array:
    """Return a row of a pair's costs at offsets of the views, the last one beyond the range."""
    margin = len(curve) // 2
    return np.asarray(curve[int(np.clip(offsets[pair[1]] - offsets[pair[0]], -margin, margin)) + margin])


def _most_common(values: IntArray) -> int:
    """Return the most common value, of several the one nearest to 0."""
    found, n = np.unique(values, return_counts=True)
    common = found[n == n.max()]
    return int(common[np.abs(common).argmin()])


def _is_clear(
    view: int, agreeing: Sequence[int], offsets: IntArray, known: IntArray, costs: Mapping[tuple[int, int], Array]
) -> bool:
    """Return whether a view fits views that agree best by its offset, and better than without it and at twice that.

    Args:
        view: which one.
        agreeing: the others.
        offsets: of all views, by which each fits best.
        known: offsets that the clocks of the cameras explain.
        costs: of pairs of views.
    """
    pairs = [(min(view, v), max(view, v)) for v in agreeing]
    if any(abs(_best_shift(costs[a, b]) - (offsets[b] - offsets[a])) > 1 for a, b in pairs):
        return False
    best = np.array([_at(costs[p], p, offsets) for p in pairs])
    for other in (known[view], 2 * offsets[view] - known[view]):
        gain = np.array([_at(costs[p], p, _with(offsets, view, int(other))) for p in pairs]) - best
        if not (np.isfinite(gain).all() and (gain.mean(axis=1) > 0).all() and (gain.mean(axis=0) > 0).all()):
            return False
    return True


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
