"""The colours of the parts: what edges cannot tell, which of two limbs an outline belongs to.

Where a pose is known the colours under each part are remembered as a histogram; of another pose they tell how well
the pixels under each part go with that part rather than with anything else in sight. Where all is of one colour the
ratio is one, and nothing is said.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from tracker.body import Body, BodyModel
from tracker.contours import FloatArray, projection
from tracker.evidence import ViewEvidence
from tracker.kernels import BORROW, helpers
from tracker.kinematics import Kinematics, Tree, forward_kinematics
from tracker.rigid import Array
from tracker.silhouettes import Image

BINS = 12
"""Bins of the histograms along each colour channel."""
_SMOOTHING_BINS = 0.7
_ALONG, _ACROSS = 7, 3
"""Samples along each part and across it."""
_MOST_NATS = 3.0
"""One pixel says at most this much."""
_DOUBT = 0.02
"""Share of pixels under a part that may show anything: what has never been seen there is not impossible."""
_LEAST_SEEN = 6
"""In a view that shows fewer samples of a part, its colour there says nothing."""
_OPEN, _HIDDEN = -1, -2
"""What `_passed` says where it names no part."""
_SPECK_M = 1e-6
"""Half axes of parts that are away."""
_TWIN_SHARE = 0.2
"""Share of what is seen under a part's twin in what is expected under itself: sleeves are mostly alike."""
_SAME = 0.25
"""Colours have changed much where their mean log ratio is below this share of the usual."""


class PartColors(NamedTuple):
    """What is remembered of the colours of one person's parts."""

    log_ratios: Array
    """Logarithm of how much likelier each colour is on the part than elsewhere, (n_parts, BINS^3), nats."""
    usual: Array
    """Mean of that under each part where it was first learnt, (n_parts,), nats."""
    shares: Array
    """Share of each colour under each part, (n_parts, BINS^3)."""
    around: Array
    """Share of each colour in the regions looked at, (BINS^3,)."""


class ColorScore(NamedTuple):
    """How well the colours under a posed body go with its parts."""

    nats: float
    """Sum of the log ratios of all visible samples."""
    parts: Array
    """Their mean under each part, (n_parts,), nats; 0 where nothing of it is visible."""
    samples: Array
    """Visible samples of each part, (n_parts,)."""
    views: Array
    """Mean log ratio under each part in each view, (V, n_parts), nats; NaN where little of it is visible."""


class Colors:
    """The colours of the parts of one person in the views of one frame."""

    def __init__(self, views: Sequence[ViewEvidence], bodies: Sequence[Body], person: int = 0) -> None:
        """Take the colours of the views.

        Args:
            views: the evidence of the frame; views without colours are passed over.
            bodies: everybody, for they hide each other.
            person: index of the body that is looked at.
        """
        seen = [v for v in views if v.colors is not None]
        self._P = [projection(v.camera) for v in seen]
        self._eyes = [v.camera.center_world for v in seen]
        self._distances = [(v.distance, v.theta_px) for v in seen]
        self._images = [v.colors for v in seen if v.colors is not None]
        self._bodies, self._person = list(bodies), person
        self._shapes = [_ellipsoids(b.model) for b in bodies]

    def learn(self, before: PartColors | None = None, share: float = 1.0) -> PartColors:
        """Remember the colours under the parts where the bodies stand; left and right parts share some of theirs.

        Args:
            before: what was known; None where nothing was.
            share: what this frame counts against it, 0 to 1. Parts under which the colours have changed much keep
                what was known: the part may not be there.
        """
        model = self._bodies[self._person].model
        parts, colors, _ = self._samples(self._bodies[self._person].values)
        twins = _twins(model)
        seen = np.zeros((len(model.parts), BINS**3))
        np.add.at(seen, (parts, colors), 1.0)
        seen = np.array([_share(s) for s in seen])
        shown = [np.bincount(_binned(i), minlength=BINS**3) for i in self._images]
        around = _share(np.sum(shown, axis=0, initial=0.0, dtype=np.float64) + np.zeros(BINS**3))
        usual = None
        if before is not None:
            now, samples = _mean_by_part(before.log_ratios[parts, colors], parts, len(model.parts))
            trusted = (samples > 0) & (now > _SAME * before.usual)
            seen = before.shares + share * trusted[:, None] * (seen - before.shares)
            around = before.around + share * (around - before.around)
            usual = before.usual
        # Half of what a part is told from is the rest of the body, however small it is in the picture.
        other = 0.5 * _smoothed(around) + 0.5 * _share(_smoothed(seen.sum(axis=0)))
        blank = seen.sum(axis=1, keepdims=True) == 0
        own = np.where(blank, seen[twins], (1 - _TWIN_SHARE) * seen + _TWIN_SHARE * seen[twins])
        own = np.array([_smoothed(_share(s)) for s in own])
        ratios = np.log(((1 - _DOUBT) * own + _DOUBT * other + 1e-7) / (other + 1e-7))
        ratios[own.sum(axis=1) == 0] = 0.0
        ratios = np.clip(ratios, -_MOST_NATS, _MOST_NATS)
        if usual is None:
            usual = _mean_by_part(ratios[parts, colors], parts, len(model.parts))[0]
        return PartColors(ratios, usual, seen, around)

    def score(self, values: Array, known: PartColors) -> ColorScore:
        """How well the colours under the person in a pose, (n_values,), go with what is known of its parts."""
        n_parts = known.log_ratios.shape[0]
        parts, colors, views = self._samples(values)
        nats = known.log_ratios[parts, colors]
        means, samples = _mean_by_part(nats, views * n_parts + parts, len(self._P) * n_parts)
        by_view = np.where(samples < _LEAST_SEEN, np.nan, means).reshape(-1, n_parts)
        return ColorScore(float(nats.sum()), *_mean_by_part(nats, parts, n_parts), by_view)

    def along_limb(
        self, candidates: Array, limb: NDArray[np.int64], known: PartColors | None, away: Sequence[int] = ()
    ) -> Array:
        """A quick look at one limb in many poses, (C, n_values): how good it seems, (C,), more is better.

        The poses differ in the limb alone. At samples along the axes of its parts, where no other part hides them, the
        colours speak, and the edges at both sides: near ones for it, none against it. Where the limb is hidden nothing
        is said. Parts that are `away` hide nothing.
        """
        model = self._bodies[self._person].model
        Ts = np.concatenate([b.model.kinematics(b.values).Ts_world_part for b in self._bodies])
        first = sum(len(b.model.parts) for b in self._bodies[: self._person])
        ratios = np.zeros((len(model.parts), BINS**3)) if known is None else known.log_ratios
        room = model.kinematics(candidates[0])
        Ts[first : first + len(model.parts)] = room.Ts_world_part
        shapes = np.concatenate(self._shapes)
        shapes[first + np.array(away, dtype=np.int64), 3:] = _SPECK_M
        limb_Ts = np.empty((len(candidates), len(limb), 4, 4))
        _place_limb(candidates, model.tree, room, limb, limb_Ts)

        def look(view: tuple[Array, Array, Image, tuple[FloatArray, float]]) -> Array:
            P, eye, image, (distance, theta) = view
            seen = np.zeros(len(candidates))
            _look_along(
                P, eye, limb_Ts, Ts, shapes, first, len(model.parts), limb, image, distance, theta, ratios, seen,
                *_room(len(Ts)),
            )  # fmt: skip
            return seen

        views = zip(self._P, self._eyes, self._images, self._distances, strict=True)
        total = np.zeros(len(candidates))
        for seen in helpers().map(look, views):
            total += seen
        return total

    def _samples(self, values: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Part, colour and view of each visible sample, (n,) each."""
        bodies = list(self._bodies)
        bodies[self._person] = Body(bodies[self._person].model, values)
        Ts = [b.model.kinematics(b.values).Ts_world_part for b in bodies]
        first = sum(len(T) for T in Ts[: self._person])
        last = first + len(Ts[self._person])
        room = (last - first) * _ALONG * _ACROSS
        parts, colors, counts = [np.empty(0, np.int64)], [np.empty(0, np.int64)], []
        all_Ts, shapes = np.concatenate(Ts), np.concatenate(self._shapes)
        for P, eye, image in zip(self._P, self._eyes, self._images, strict=True):
            out = np.empty((room, 2), np.int64)
            n = _look(P, eye, all_Ts, shapes, first, last, image, out, *_room(len(all_Ts)))
            parts.append(out[:n, 0])
            colors.append(out[:n, 1])
            counts.append(n)
        views = np.repeat(np.arange(len(counts)), counts)
        return np.concatenate(parts), np.concatenate(colors), views


def _binned(image: Image) -> NDArray[np.int64]:
    """Index of each pixel's colour bin, (H, W, 3) to (H * W,)."""
    steps = image.reshape(-1, 3).astype(np.int64) * BINS // 256
    return (steps[:, 0] * BINS + steps[:, 1]) * BINS + steps[:, 2]


def _smoothed(counts: Array) -> Array:
    cube = np.asarray(counts, dtype=np.float64).reshape(BINS, BINS, BINS)
    return np.asarray(gaussian_filter(cube, _SMOOTHING_BINS, mode="nearest")).ravel()


def _share(counts: Array) -> Array:
    return counts / max(1e-12, float(counts.sum()))


def _mean_by_part(nats: Array, parts: NDArray[np.int64], n_parts: int) -> tuple[Array, Array]:
    samples = np.bincount(parts, minlength=n_parts)
    return np.bincount(parts, weights=nats, minlength=n_parts) / np.maximum(samples, 1), samples.astype(np.float64)


def _twins(model: BodyModel) -> NDArray[np.int64]:
    """Index of each part's twin on the other side; of itself where there is none."""
    names = [p.name for p in model.parts]
    swapped = [n.replace("left", "?").replace("right", "left").replace("?", "right") for n in names]
    return np.array([names.index(n) if n in names else i for i, n in enumerate(swapped)])


def _ellipsoids(model: BodyModel) -> Array:
    """Centre and half-axes of the ellipsoids that stand for the parts, (n_parts, 6), metres."""
    return np.array([(*c, *s.half_axes) for c, s in zip(model.centers_part, model.shapes, strict=True)])


def _room(n_parts: int) -> tuple[Array, Array, Array]:
    """Room for what kernels work out: a row of each part, see `_place_before`, and two points."""
    return np.empty((n_parts, 13)), np.empty(3), np.empty(3)


@njit(**BORROW)
def _place_before(eye: Array, T: Array, shape: Array, sight: Array) -> None:
    """Fill what `_passed` asks of a part, (13,): what turns directions into the coordinates in which the part is the
    unit ball, the eye in these, and the square of its distance from the ball."""
    C = -1.0
    for i in range(3):
        o = -shape[i]
        for k in range(3):
            o += T[k, i] * (eye[k] - T[k, 3])
            sight[3 * i + k] = T[k, i] / shape[3 + i]
        o /= shape[3 + i]
        sight[9 + i] = o
        C += o * o
    sight[12] = C


@njit(**BORROW)
def _passed(eye: Array, X: Array, own: int, sights: Array) -> int:
    """What the sight of a point X on the axis of a part passes besides: the index of a part behind the point, `_OPEN`
    where there is none, and `_HIDDEN` where another part lies before the point."""
    behind = _OPEN
    x, y, z = X[0] - eye[0], X[1] - eye[1], X[2] - eye[2]
    for p in range(sights.shape[0]):
        d0 = sights[p, 0] * x + sights[p, 1] * y + sights[p, 2] * z
        d1 = sights[p, 3] * x + sights[p, 4] * y + sights[p, 5] * z
        d2 = sights[p, 6] * x + sights[p, 7] * y + sights[p, 8] * z
        A = d0 * d0 + d1 * d1 + d2 * d2
        B = sights[p, 9] * d0 + sights[p, 10] * d1 + sights[p, 11] * d2
        # Where the middle of the chord lies beyond the point, the point is before or just within the other part.
        if B * B - A * sights[p, 12] > 0.0 and B < 0.0 and p != own:
            if -B < A:
                return _HIDDEN
            behind = p
    return behind


@njit(**BORROW)
def _seen_on_axis(
    P: Array, eye: Array, T: Array, shape: Array, sights: Array, part: int, sample: int, X: Array, side: Array
) -> int:
    """What a sample on the axis of a part is seen before, see `_passed`; fills its place X and the unit vector across
    axis and sight."""
    z = shape[2] + shape[5] * 0.8 * (2.0 * sample / (_ALONG - 1) - 1.0)
    for i in range(3):
        X[i] = T[i, 0] * shape[0] + T[i, 1] * shape[1] + T[i, 2] * z + T[i, 3]
    behind = _HIDDEN
    if P[2, 0] * X[0] + P[2, 1] * X[1] + P[2, 2] * X[2] + P[2, 3] >= 0.05:
        behind = _passed(eye, X, part, sights)
    if behind == _HIDDEN:
        return behind
    ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
    vx, vy, vz = X[0] - eye[0], X[1] - eye[1], X[2] - eye[2]
    side[0], side[1], side[2] = ay * vz - az * vy, az * vx - ax * vz, ax * vy - ay * vx
    norm = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2) + 1e-9
    side[0], side[1], side[2] = side[0] / norm, side[1] / norm, side[2] / norm
    return behind


@njit(**BORROW)
def _pixel_beside(P: Array, X: Array, side: Array, offset: float) -> tuple[int, int]:
    """Column and row of the pixel that shows the place at an offset from X, metres, to the side."""
    x, y, w = X[0] + offset * side[0], X[1] + offset * side[1], X[2] + offset * side[2]
    depth = P[2, 0] * x + P[2, 1] * y + P[2, 2] * w + P[2, 3]
    u = int(np.floor((P[0, 0] * x + P[0, 1] * y + P[0, 2] * w + P[0, 3]) / depth + 0.5))
    v = int(np.floor((P[1, 0] * x + P[1, 1] * y + P[1, 2] * w + P[1, 3]) / depth + 0.5))
    return u, v


@njit(nogil=True, cache=True)
def _place_limb(candidates: Array, tree: Tree, room: Kinematics, limb: NDArray[np.int64], out: Array) -> None:
    """Fill the poses of the parts of one limb, (C, n, 4, 4), in each of many poses of a body."""
    for c in range(candidates.shape[0]):
        forward_kinematics(candidates[c], tree, room.Ts_world_part, room.axes_world, room.origins_world)
        for i in range(limb.shape[0]):
            out[c, i] = room.Ts_world_part[limb[i]]


@njit(**BORROW)
def _look_along(
    P: Array, eye: Array, limb_Ts: Array, Ts: Array, shapes: Array, first: int, n_parts: int,
    limb: NDArray[np.int64], image: Image, distance: FloatArray, theta: float, ratios: Array, total: Array,
    sights: Array, X: Array, side: Array,
) -> None:  # fmt: skip
    """Add to the totals (C,) what one view says of each candidate's limb; the last three are room to work in."""
    height, width = distance.shape
    for p in range(Ts.shape[0]):
        _place_before(eye, Ts[p], shapes[p], sights[p])
    for c in range(limb_Ts.shape[0]):
        for i in range(limb.shape[0]):
            _place_before(eye, limb_Ts[c, i], shapes[first + limb[i]], sights[first + limb[i]])
        for i in range(limb.shape[0]):
            part = limb[i]
            p = first + part
            for a in range(_ALONG):
                behind = _seen_on_axis(P, eye, limb_Ts[c, i], shapes[p], sights, p, a, X, side)
                if behind == _HIDDEN:
                    continue
                # What would be seen there without the limb: to show its colour again says nothing for the limb.
                own = first <= behind < first + n_parts
                for s in range(5):
                    u, v = _pixel_beside(P, X, side, 0.5 * (s - 2) * shapes[p, 3])
                    if u < 0 or v < 0 or u >= width or v >= height:
                        total[c] -= 0.25
                    elif s == 0 or s == 4:
                        total[c] += 1.5 * (0.3 - min(distance[v, u] / theta, 1.0))
                    else:
                        color = _bin_of(image, v, u)
                        total[c] += ratios[part, color] - (ratios[behind - first, color] if own else 0.0)


@njit(**BORROW)
def _bin_of(image: Image, v: int, u: int) -> int:
    """Index of a pixel's colour."""
    r, g, b = image[v, u, 0] * BINS // 256, image[v, u, 1] * BINS // 256, image[v, u, 2] * BINS // 256
    return (r * BINS + g) * BINS + b


@njit(**BORROW)
def _look(
    P: Array,
    eye: Array,
    Ts: Array,
    shapes: Array,
    first: int,
    last: int,
    image: Image,
    out: NDArray[np.int64],
    sights: Array,
    X: Array,
    side: Array,
) -> int:
    """List part and colour of the visible samples of the parts from first to last in one view; their number."""
    height, width = image.shape[0], image.shape[1]
    for p in range(Ts.shape[0]):
        _place_before(eye, Ts[p], shapes[p], sights[p])
    n = 0
    for part in range(first, last):
        radius = 0.45 * min(shapes[part, 3], shapes[part, 4])
        for a in range(_ALONG):
            if _seen_on_axis(P, eye, Ts[part], shapes[part], sights, part, a, X, side) == _HIDDEN:
                continue
            for s in range(_ACROSS):
                u, v = _pixel_beside(P, X, side, radius * (s - (_ACROSS - 1) / 2))
                if 0 <= u < width and 0 <= v < height:
                    out[n, 0], out[n, 1] = part - first, _bin_of(image, v, u)
                    n += 1
    return n
