"""People by the names that the files give them, before any camera is known.

A file names a person alike in its pictures. Files of two cameras may use one name for two people, as where names are
numbers of tracks. People who are taken for each other fit no relative pose of two cameras, so names can be compared.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.boards.view_choice import MAX_LENS_VIEWS
from tracker.compute.sampling import spread_indices
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.observed import ObservedPoints

_Order = tuple[int, ...]
"""For each name of a camera, by its number, the number of the same person's name in another camera; -1 for none."""


class NamedPeople(NamedTuple):
    """People of the pictures by name."""

    names: tuple[str, ...]
    persons: IntArray
    """Person of each detection, (n_frames, n_views, n_detections), a row of `names`; -1 for one without a name."""
    renamed: tuple[str, ...] = ()
    """Cameras whose files name people otherwise."""
    unproved: tuple[str, ...] = ()
    """Cameras whose names might as well be exchanged, by the joints."""
    named_by: str = ""
    """Camera that the names are of."""


def people_by_name(points: ObservedPoints, cameras: Sequence[Camera], columns: Sequence[int]) -> NamedPeople | None:
    """Return the people by the names of the files; None where a file names nobody, or no picture shows several people.

    Names count as given, unless the people of two cameras fit each other clearly better otherwise. Names that differ
    between cameras count only where they do.

    Args:
        points: key points in pictures.
        cameras: with their lenses, or average ones.
        columns: points that are compared.
    """
    tracks, present = points.tracks, np.asarray(points.is_known.any(axis=-1))
    most = int(present.sum(axis=2).max(initial=0))
    if tracks is None or most < 2:
        return None
    is_named = present & (tracks != "") & _is_only(tracks, present)
    own = [_most_frequent(tracks[:, v][is_named[:, v]], most) for v in range(present.shape[1])]
    if not all(own):
        return None
    first = max(range(len(own)), key=lambda v: len(own[v]))
    joints = [_joints(points, columns, cameras[v], v, own[v], is_named) for v in range(len(own))]
    pairs = {(a, b): _compared(joints[a], joints[b], own[a], own[b]) for a, b in combinations(range(len(own)), 2)}
    given = [tuple(own[first].index(name) if name in own[first] else -1 for name in names) for names in own]
    found = _along_tree(pairs, first, own)
    has_names = all(max(order) >= 0 for order in given)
    chosen = found if not has_names or _cost(pairs, found) < _cost(pairs, given) - np.log(2) else given
    unproved = [v for v in range(len(own)) if v != first and not _is_clear(pairs, chosen, v)]
    if unproved and not has_names:
        return None
    persons = np.full(present.shape, -1)
    for v, order in enumerate(chosen):
        for name, person in zip(own[v], order, strict=True):
            persons[:, v][is_named[:, v] & (tracks[:, v] == name)] = person
    renamed = [points.cameras[v] for v in range(len(own)) if chosen[v] != given[v] or max(given[v]) < 0]
    return NamedPeople(
        own[first], persons, tuple(renamed), tuple(points.cameras[v] for v in unproved), points.cameras[first]
    )


def _is_only(tracks: NDArray[np.str_], present: Mask) -> Mask:
    """Return which detections are the only ones of their name in a picture, (F, V, D)."""
    same = (tracks[..., :, None] == tracks[..., None, :]) & present[..., None, :]
    return np.asarray(same.sum(axis=-1) == 1)


def _most_frequent(tracks: NDArray[np.str_], most: int) -> tuple[str, ...]:
    """Return the most frequent names, in alphabetical order."""
    names, counts = np.unique(tracks, return_counts=True)
    return tuple(sorted(str(names[i]) for i in np.argsort(-counts, kind="stable")[:most]))


def _joints(
    points: ObservedPoints, columns: Sequence[int], camera: Camera, v: int, names: Sequence[str], is_named: Mask
) -> list[Array]:
    """Return x / z and y / z of the rays of each person of a camera on some frames, (F, J, 2); NaN where absent."""
    assert points.tracks is not None
    frames = spread_indices(points.n_frames, MAX_LENS_VIEWS)
    px = np.where(points.is_known[..., None], points.points_px, np.nan)[frames, v][:, :, columns]
    rays = camera.rays(px.reshape(-1, 2)).reshape(*px.shape[:-1], 3)
    slopes = rays[..., :2] / rays[..., 2:]
    out = []
    for name in names:
        is_own = (is_named[:, v] & (points.tracks[:, v] == name))[frames]
        one = np.take_along_axis(slopes, is_own.argmax(axis=1)[:, None, None, None], axis=1)[:, 0]
        out.append(np.where(is_own.any(axis=1)[:, None, None], one, np.nan))
    return out


def _compared(
    a: Sequence[Array], b: Sequence[Array], names_a: Sequence[str], names_b: Sequence[str]
) -> dict[_Order, float]:
    """Return the logarithm of the misfit of two cameras by the order of the second one's people in the first.

    The orders are those of equal names, of least misfit of each two people, and all in which two people of it are
    exchanged. Orders without misfit are left out.
    """
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    single = np.array([[_misfit([(x, y)]) for x in a] for y in b])
    rows, columns = linear_sum_assignment(np.nan_to_num(single, nan=np.nanmax(single, initial=0.0)))
    best = np.full(len(b), -1)
    best[rows] = columns
    given = [list(names_a).index(name) if name in names_a else -1 for name in names_b]
    orders = {tuple(order.tolist()) for order in (best, np.array(given))}
    for i, j in combinations(range(len(b)), 2):
        for order in (best.copy(), np.array(given)):
            order[[i, j]] = order[[j, i]]
            orders.add(tuple(order.tolist()))
    misfits = {o: _misfit([(a[p], y) for p, y in zip(o, b, strict=True) if p >= 0]) for o in sorted(orders)}
    return {order: float(np.log(m)) for order, m in misfits.items() if m > 0}


def _misfit(pairs: Sequence[tuple[Array, Array]]) -> float:
    """Return the median distance of joints of some people from epipolar lines, as slopes; NaN for too few frames.

    The essential matrix is that of the least median.
    """
    x, y = (
        np.concatenate(side) if pairs else np.zeros((0, 1, 2))
        for side in (zip(*pairs, strict=True) if pairs else ((), ()))
    )
    both = np.asarray(np.isfinite(np.concatenate([x, y], axis=-1)).all(axis=-1))
    if both.any(axis=1).sum() < MIN_SHARED:
        return np.nan
    a, b = x[both], y[both]
    E, _ = cv2.findEssentialMat(a, b, np.eye(3), cv2.LMEDS)
    if E is None or E.shape != (3, 3):
        return np.nan
    a, b = (np.column_stack([p, np.ones(len(p))]) for p in (a, b))
    lines, back = a @ E.T, b @ E
    # Sampson's distance (Hartley and Zisserman 2004, Eq. 11.9).
    return float(
        np.median(np.abs((b * lines).sum(axis=1)) / np.sqrt((lines[:, :2] ** 2 + back[:, :2] ** 2).sum(axis=1)))
    )


_Pairs = dict[tuple[int, int], dict[_Order, float]]


def _along_tree(pairs: _Pairs, first: int, own: Sequence[Sequence[str]]) -> list[_Order]:
    """Return the order of each camera's people in the first one, along the pairs that show it most clearly."""
    chosen: dict[int, _Order] = {first: tuple(range(len(own[first])))}
    while len(chosen) < len(own):
        margins = {
            (v, w): _margin(pairs[min(v, w), max(v, w)]) for v in range(len(own)) if v not in chosen for w in chosen
        }
        v, w = max(margins, key=lambda pair: margins[pair])
        misfits = pairs[min(v, w), max(v, w)]
        order = min(misfits, key=lambda o: misfits[o], default=(-1,) * len(own[max(v, w)]))
        if v < w:  # the order of w's people in v
            order = tuple(order.index(i) if i in order else -1 for i in range(len(own[v])))
        chosen[v] = tuple(chosen[w][i] if i >= 0 else -1 for i in order)
    return [chosen[v] for v in range(len(own))]


def _margin(misfits: dict[_Order, float]) -> float:
    """Return by how much the best order is better than the next, as a difference of logarithms."""
    values = sorted(misfits.values())
    return values[1] - values[0] if len(values) > 1 else 0.0


def _cost(pairs: _Pairs, orders: Sequence[_Order]) -> float:
    """Return the sum of the logarithms of the misfits of all pairs of cameras."""
    return sum(_of_pair(misfits, orders[a], orders[b]) for (a, b), misfits in pairs.items())


def _of_pair(misfits: dict[_Order, float], a: _Order, b: _Order) -> float:
    """Return the logarithm of the misfit of two cameras by the orders of both; of one not tried, that of the worst."""
    order = tuple(a.index(person) if person >= 0 and person in a else -1 for person in b)
    return misfits.get(order, max(misfits.values(), default=0.0))


def _is_clear(pairs: _Pairs, orders: Sequence[_Order], v: int) -> bool:
    """Return whether each exchange of two people of a camera at least doubles the product of the misfits."""
    present = _cost(pairs, orders)
    for i, j in combinations(range(len(orders[v])), 2):
        other = list(orders[v])
        other[i], other[j] = other[j], other[i]
        if _cost(pairs, [*orders[:v], tuple(other), *orders[v + 1 :]]) < present + np.log(2):
            return False
    return True
