"""Sum the contour residuals of one pose over all views: trace, match, and accumulate part by part."""

import numpy as np

from tracker.compute.jit import FAST_MATH, ONE, ZERO, njit
from tracker.estimation.fitting.contour_arrays import ContourMotion, ContourTerm, Scratch, Sums, ViewArrays
from tracker.estimation.fitting.segment_matching import match_points, pack_visible, store_static
from tracker.estimation.fitting.twists import add_twists
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import PIECE_PX, StaticContours, place_parts
from tracker.evidence.contours.static_cache import copy_poses, is_static_unchanged, trace_moving_parts
from tracker.evidence.images.distance_transform import bilinear
from tracker.evidence.view_evidence import SCENE_SPACING_PX


@njit(**FAST_MATH)
def _model_to_image(
    view: int, first: int, last: int, pixel: int, views: ViewArrays, scale: float, motion: int, with_jacobian: bool,
    static: StaticContours, scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the model-to-image residuals of the visible pieces of some parts; return their cost."""
    width, height = views.sizes[view, 0], views.sizes[view, 1]
    theta, weight = np.float32(views.thetas[view]), np.float32(views.weights[view, 0])
    q, pulls, firsts = scratch.pieces, scratch.pulls, scratch.firsts
    image, right, bottom = (
        views.distances[pixel : pixel + width * height],
        np.float32(width - 1),
        np.float32(height - 1),
    )
    s2, cost = np.float32((scale * theta) ** 2), 0.0
    for part in range(first, last):
        seen = far = 0.0
        pulled = with_jacobian and static.moves[part]
        for k in range(np.uint64(firsts[part]), np.uint64(firsts[part + 1])):
            x, y, length = q[0, k], q[1, k], q[2, k]
            # Outside the image there is no evidence for or against a contour.
            if x < ZERO or y < ZERO or x > right or y > bottom:
                continue
            d, along_u, along_v = bilinear(image, width, height, x, y)
            cut = min(d, theta)
            f = s2 / (s2 + cut * cut)
            seen += length
            far += length * cut
            cost += length * f * cut * cut
            if pulled and d < theta:
                across = q[3, k] * along_u + q[4, k] * along_v
                w = weight * length * (f * f)
                if motion == ContourMotion.ACROSS:
                    pulls[0, k] += w * across * across
                    pulls[1, k] += w * across * d
                    continue
                pulls[2, k] += w * along_u * along_u
                pulls[3, k] += w * along_u * along_v
                pulls[4, k] += w * along_v * along_v
                pulls[5, k] += w * d * along_u
                pulls[6, k] += w * d * along_v
        sums.parts[view, part, 0] += seen
        sums.parts[view, part, 1] += far
    return 0.5 * float(weight) * cost


@njit(**FAST_MATH)
def _image_to_model(
    view: int, n_segments: int, views: ViewArrays, scale: float, turn: float, with_jacobian: bool,
    static: StaticContours, scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the image-to-model residuals of the edge points nearest to a moving part; return the cost of all points.

    The points are the same at every pose, so that costs are comparable. A point without a piece nearby, or nearest to
    another person, costs as much as a point at the outlier distance.
    """
    theta, weight = views.thetas[view], np.float32(views.weights[view, 1] * SCENE_SPACING_PX)
    s2, limit, cost = np.float32((scale * theta) ** 2), np.float32(theta * theta), 0.0
    start, stop = views.firsts[view], views.firsts[view + 1]
    us, vs, q, of = views.points[0][start:stop], views.points[1][start:stop], scratch.segments, scratch.of_segment
    weights, counts = views.points[4][start:stop], views.points[5][start:stop]
    best, nearest, pulls = scratch.best, scratch.nearest, scratch.pulls
    match_points(view, n_segments, views, turn, static, scratch)
    n, pull = np.uint64(stop - start), scratch.pull
    for j in range(n):
        squared = min(best[j], limit)
        f = s2 / (s2 + squared)
        cost += weights[j] * (f * squared)
        pull[j] = weight * weights[j] * (f * f)
    for j in range(n):
        if best[j] >= limit or nearest[j] < 0:
            continue
        k = np.uint64(nearest[j])
        part = of[2, k]
        if not with_jacobian:  # part costs count explained points
            sums.parts[view, part, 2] += counts[j]
            continue
        if not static.moves[part]:
            continue
        w, u, v, dx, dy, count = pull[j], us[j] - q[0, k], vs[j] - q[1, k], q[2, k], q[3, k], of[1, k]
        t = (u * dx + v * dy) * q[4, k]
        i = np.uint64(of[0, k] + min(max(int(t * np.float32(count)), 0), count - 1))
        if t > ZERO and t < ONE:
            pulls[0, i] += w
            pulls[1, i] -= w * (u * q[5, k] + v * q[6, k])
            continue
        if t > ZERO:
            u, v = u - dx, v - dy
        d = np.sqrt(u * u + v * v)
        if d < np.float32(1e-3):
            gu, gv = q[5, k], q[6, k]
        else:
            gu, gv = -u / d, -v / d
        pulls[2, i] += w * gu * gu
        pulls[3, i] += w * gu * gv
        pulls[4, i] += w * gv * gv
        pulls[5, i] += w * d * gu
        pulls[6, i] += w * d * gv
    return 0.5 * float(weight) * cost


WITH_JACOBIAN, COST_ONLY = np.bool_(True), np.bool_(False)
"""Values of `with_jacobian`. Literals in a kernel would have `accumulate_normal_equations` compiled once for each."""


@njit(**FAST_MATH)
def accumulate_normal_equations(term: ContourTerm, with_jacobian: bool) -> float:
    """Fill the sums for one pose of the fitted parts, the others being fixed; return the cost.

    Without `with_jacobian` the normal matrices stay 0. With it the matrices of static parts stay 0 (see
    `static_cache`).
    """
    Ts, first, last, surfaces, views, scale, turn, motion, static, scratch, sums = term
    sums.M[:] = 0.0
    sums.b[:] = 0.0
    sums.parts[:] = 0.0
    sums.costs[:] = 0.0
    pixel, cost, caches = np.int64(0), 0.0, static.best.shape[0] > 0  # a literal 0 has a type of its own
    stale = caches and not is_static_unchanged(Ts, static.moves, static.Ts)
    place_parts(Ts, surfaces, scratch.traced)
    for view in range(views.P.shape[0]):
        if stale:
            store_static(view, surfaces, views, turn, static, scratch)
        if views.weights[view, 0] > 0.0 or views.weights[view, 1] > 0.0:
            P, eye, traced = views.P[view], views.eyes[view], scratch.traced
            if caches:
                trace_moving_parts(view, P, eye, surfaces, PIECE_PX, static, traced)
            else:
                occluding_contours.trace_pieces(P, eye, surfaces, PIECE_PX, traced)
            n_segments = pack_visible(Ts.shape[0], scratch)
            scratch.pulls[:, : scratch.firsts[-1]] = 0.0
            # The costs of the parts need both directions.
            if views.weights[view, 0] > 0.0 or not with_jacobian:
                sums.costs[view] += _model_to_image(
                    view, first, last, pixel, views, scale, motion, with_jacobian, static, scratch, sums
                )
            if views.weights[view, 1] > 0.0:
                sums.costs[view] += _image_to_model(
                    view, n_segments, views, scale, turn, with_jacobian, static, scratch, sums
                )
            cost += sums.costs[view]
            if with_jacobian:
                for part in range(first, last):
                    if not static.moves[part]:
                        continue
                    span, W = scratch.firsts[part : part + 2], scratch.traced.Ts_world_unit[part]
                    slides = motion == ContourMotion.SLIDING and surfaces.profile_sizes[part] > 0
                    add_twists(span, scratch.pieces, scratch.pulls, P, W, eye, slides, sums.M[part], sums.b[part])
        pixel += views.sizes[view, 0] * views.sizes[view, 1]
    if stale:
        copy_poses(Ts, static.Ts)
    return cost
