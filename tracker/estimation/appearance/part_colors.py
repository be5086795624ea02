"""Learn the colours of body parts, which tell apart limbs whose edges look alike.

At a known pose the colours under each part are collected in a histogram. At another pose the log ratio of these colours
against everything else in view scores the pixels under each part. If everything has one colour, the ratio is 0.

Smoothed histograms of colours as shares.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics, chain_poses
from tracker.body.model import BodyModel, PosedBody, ahead, parts_of
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.appearance.axis_visibility import (
    ALONG,
    axis_sample,
    ellipsoids,
    is_occluded,
    pixel_on_axis,
    project_axis,
    ray_transform,
    unit_balls,
)
from tracker.estimation.appearance.limb_score import ColorView, LimbScore, LimbScorer, StaticParts
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.evidence.images.color_histogram import BINS, bin_of
from tracker.evidence.view_evidence import ViewEvidence, outliers_px
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M

_ACROSS = 3
"""Samples across each part."""
MAX_NATS = 3.0
"""Largest score of one pixel, nats: one sample, even of the purest colour, must not outweigh the rest of a part.
Halved, two more frames of `fast_arms` are lost from joints; doubled, one more, and its error grows by 1.2 mm
(acquisition.py). On `walk` both change the error by less than 0.1 mm."""
MIN_SAMPLES = 6
"""Smallest number of samples of a part, in a view or in all, for a score of its own there. Halved and doubled, the
errors of `walk` and `fast_arms` from joints change by 0.3 mm at most, and one or two frames less are lost
(acquisition.py)."""


class PartColors(NamedTuple):
    """Learnt colours of one person's parts."""

    log_ratios: Array
    """Log of how much likelier each colour is on the part than elsewhere, (n_parts, BINS^3), nats."""
    shares: Array
    """Share of each colour under each part, (n_parts, BINS^3)."""
    around: Array
    """Share of each colour in the regions of all views, (BINS^3,)."""


class ColorScore(NamedTuple):
    """Score of the colours under a posed body."""

    nats: float
    """Sum of the log ratios of all visible samples."""
    parts: Array
    """Mean log ratio under each part, (n_parts,), nats; 0 if it is not visible."""
    samples: Array
    """Visible samples of each part, (n_parts,)."""


class _Samples(NamedTuple):
    """Buffers for the visible samples of one view."""

    found: IntArray
    """Part and colour of each sample, (room, 2)."""
    rays: Array
    """See `ray_transform`, (P, 13)."""
    cones: Array
    """See `_cone`, (P, 4)."""
    near: IntArray
    """Indices of possible occluders, (P,)."""
    axis: Array
    """See `project_axis`, (4, 3)."""


class _Moment(NamedTuple):
    """Views whose pictures were taken at the same time."""

    ahead_frames: float
    """Frames by which the pictures were taken later than the frame."""
    views: IntArray
    """Indices of the views, (n,)."""
    Ts_world_part: Array
    """Poses of all parts, (P, 4, 4), metres."""


class Colors:
    """Colours of the parts of one person in the views of one frame, each at the time of its picture."""

    def __init__(self, views: Sequence[ViewEvidence], bodies: Sequence[PosedBody], person: int = 0) -> None:
        """Take the colours of the views.

        Args:
            views: evidence of the frame; views without colours are ignored.
            bodies: all bodies; they occlude each other.
            person: index of the scored body.
        """
        self._views = [
            ColorView(v.camera.projection, v.camera.center_world, v.colors, v.distance, theta)
            for v, theta in zip(views, outliers_px(views, None).tolist(), strict=True)
            if v.colors is not None
        ]
        self._ahead_frames = np.array([v.ahead_frames for v in views if v.colors is not None])
        self._shown = tuple(views)
        self._bodies, self._person = list(bodies), person
        self._shapes = np.concatenate([ellipsoids(b.model) for b in bodies])
        self._own = parts_of([b.model for b in bodies], person)

    def learn(self, before: PartColors | None = None, share: float = 1.0) -> PartColors:
        """Learn the colours under the parts at the current poses; a part that is not seen has those of the other side.

        Args:
            before: learnt so far; None at first.
            share: weight of this frame, 0 to 1. Parts whose colours have changed much keep the learnt ones, because the
                part may be elsewhere.
        """
        model = self._bodies[self._person].model
        parts, colors = self._samples(self._bodies[self._person].values)
        twins = counterparts([model])
        seen = np.zeros((len(model.parts), BINS**3))
        np.add.at(seen, (parts, colors), 1.0)
        seen = np.array([_share(s) for s in seen])
        around = _share(np.sum([v.color_counts for v in self._shown], axis=0) + np.zeros(BINS**3))
        if before is not None:
            now, samples = _mean_by_part(before.log_ratios[parts, colors], parts, len(model.parts))
            trusted = (samples > 0) & (now > 0)
            seen = before.shares + share * trusted[:, None] * (seen - before.shares)
            around = before.around + share * (around - before.around)
        # Half of the alternative to a part's colours is the rest of the body, however small it is in the image.
        other = 0.5 * smoothed(around) + 0.5 * _share(smoothed(seen.sum(axis=0)))
        blank = seen.sum(axis=1, keepdims=True) == 0
        own = np.where(blank, seen[twins], seen)
        own = smoothed(np.array([_share(s) for s in own]))
        ratios = np.log(((1 - DOUBT) * own + DOUBT * other + 1e-7) / (other + 1e-7))
        ratios[own.sum(axis=1) == 0] = 0.0
        ratios = np.clip(ratios, -MAX_NATS, MAX_NATS)
        return PartColors(ratios, seen, around)

    def score(self, pose: Array, known: PartColors) -> ColorScore:
        """Return how well the colours under the person in a pose, (n_values,), match the learnt colours of its
        parts."""
        n_parts = known.log_ratios.shape[0]
        parts, colors = self._samples(pose)
        nats = known.log_ratios[parts, colors]
        return ColorScore(float(nats.sum()), *_mean_by_part(nats, parts, n_parts))

    def nats(self, poses: Array, known: PartColors) -> Array:
        """Return `score(...).nats` of many poses, (C, n_values), (C,)."""
        body, first, ratios = self._bodies[self._person], self._own.start, known.log_ratios
        samples, nats = self._buffers(self._max_samples), np.zeros(len(poses))
        for moment in self._moments:
            then, Ts = body.poses_ahead(poses, moment.ahead_frames), moment.Ts_world_part.copy()
            model = body.model
            placed = chain_poses(model.tree, model.kinematics(then[0]), np.arange(len(model.parts)), then)
            for i in moment.views:
                _add_nats(self._views[i], Ts, placed, first, self._shapes, ratios, samples, nats)
        return nats

    def limb_scorer(
        self, pose: Array, limb: NDArray[np.int64], known: PartColors | None, away: Sequence[int] = ()
    ) -> LimbScore:
        """Return a scorer of one limb in many poses.

        Args:
            pose: pose of everything but the limb, (n_values,).
            limb: indices of its parts, from the trunk outwards.
            known: learnt colours; None to score edges only.
            away: indices of parts that are removed and occlude nothing.
        """
        body = self._bodies[self._person]
        owners = np.full(len(self._shapes), -1)
        owners[self._own] = np.arange(len(body.model.parts))
        is_static = ~np.isin(owners, [*limb, *away])

        def at(moment: _Moment) -> LimbScorer:
            rest = body.model.kinematics(body.poses_ahead(pose[None], moment.ahead_frames)[0])
            return LimbScorer(
                [self._views[i] for i in moment.views], body.model, rest, limb,
                StaticParts(self._Ts(moment, rest)[is_static] @ unit_balls(self._shapes[is_static]), owners[is_static]),
                self._shapes[self._own], None if known is None else known.log_ratios,
            )  # fmt: skip

        scorers = [(m.ahead_frames, at(m)) for m in self._moments]
        return lambda poses: np.sum([score(body.poses_ahead(poses, time)) for time, score in scorers], axis=0)

    def _Ts(self, moment: _Moment, own: Kinematics) -> Array:
        """Return the poses of all parts, (P, 4, 4), metres, with the person's from its kinematics."""
        Ts = moment.Ts_world_part.copy()
        Ts[self._own] = own.Ts_world_part
        return Ts

    @cached_property
    def _moments(self) -> list[_Moment]:
        """The views by the time of their pictures; there is one moment at least."""
        times = self._ahead_frames if self._bodies[self._person].velocity is not None else 0 * self._ahead_frames
        out = []
        for time in np.unique(times).tolist() or [0.0]:
            out.append(_Moment(time, np.flatnonzero(times == time), part_poses(ahead(self._bodies, time))))
        return out

    def _samples(self, pose: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return part and colour of each visible sample, (n,) each, view by view."""
        body = self._bodies[self._person]
        samples, n = self._buffers(self._max_samples * len(self._views)), 0
        first, last, Ts = self._own.start, self._own.stop, [np.empty(0)] * len(self._views)
        for moment in self._moments:
            placed = self._Ts(moment, body.model.kinematics(body.poses_ahead(pose[None], moment.ahead_frames)[0]))
            for i in moment.views:
                Ts[i] = placed
        for i, view in enumerate(self._views):
            n += _list_samples(view, Ts[i], self._shapes, first, last, samples._replace(found=samples.found[n:]))
        return samples.found[:n, 0], samples.found[:n, 1]

    @property
    def _max_samples(self) -> int:
        """Largest number of samples in a view."""
        return len(self._bodies[self._person].model.parts) * ALONG * _ACROSS

    def _buffers(self, n_samples: int) -> _Samples:
        """Return buffers for a number of samples."""
        n = len(self._shapes)
        return _Samples(
            np.empty((n_samples, 2), np.int64), np.empty((n, 13)), np.empty((n, 4)), np.empty(n, np.int64),
            np.empty((4, 3)),
        )  # fmt: skip


def counterparts(models: Sequence[BodyModel]) -> IntArray:
    """Return the index of each part's counterpart on the other side, or of itself without one, (P,)."""
    out, first = list[int](), 0
    for model in models:
        names = [p.name for p in model.parts]
        swapped = [n.replace("left", "?").replace("right", "left").replace("?", "right") for n in names]
        out += [first + (names.index(n) if n in names else i) for i, n in enumerate(swapped)]
        first += len(names)
    return np.array(out)


def _share(counts: Array) -> Array:
    return counts / max(TINY, float(counts.sum()))


def _mean_by_part(nats: Array, parts: NDArray[np.int64], n_parts: int) -> tuple[Array, Array]:
    samples = np.bincount(parts, minlength=n_parts)
    return np.bincount(parts, weights=nats, minlength=n_parts) / np.maximum(samples, 1), samples.astype(np.float64)


@njit(**NO_REFCOUNT)
def _add_nats(
    view: ColorView, Ts: Array, placed: Array, first: int, shapes: Array, log_ratios: Array, samples: _Samples,
    nats: Array,
) -> None:  # fmt: skip
    """Add the score of one view to each of many poses, (C,).

    Args:
        view: the view.
        Ts: poses of all parts, (P, 4, 4), metres; those of the person are overwritten.
        placed: poses of the person's parts, (C, n, 4, 4), metres.
        first: index of the person's first part.
        shapes: ellipsoids of all parts, (P, 6), metres.
        log_ratios: see `PartColors`.
        samples: buffers.
        nats: added to.
    """
    last, found = first + placed.shape[1], samples.found
    for c in range(placed.shape[0]):
        for part in range(placed.shape[1]):
            for i in range(3):
                for k in range(4):
                    Ts[first + part, i, k] = placed[c, part, i, k]
        for i in range(_list_samples(view, Ts, shapes, first, last, samples)):
            nats[c] += log_ratios[found[i, 0], found[i, 1]]


@njit(**NO_REFCOUNT)
def _list_samples(view: ColorView, Ts: Array, shapes: Array, first: int, last: int, samples: _Samples) -> int:
    """List part and colour of the visible samples of some parts in one view; return their number.

    Args:
        view: the view.
        Ts: poses of all parts, (P, 4, 4), metres.
        shapes: their ellipsoids, (P, 6), metres.
        first: index of the first listed part.
        last: index after the last.
        samples: buffers; the first two columns of `found` are filled.
    """
    P, eye, image, _, _ = view
    found, rays, cones, near, axis = samples
    height, width = image.shape[0], image.shape[1]
    for p in range(Ts.shape[0]):
        ray_transform(eye, Ts[p], shapes[p], rays[p])
        _cone(eye, Ts[p], shapes[p], cones[p])
    n = 0
    for part in range(first, last):
        radius = 0.45 * min(shapes[part, 3], shapes[part, 4])
        n_near = _possible_occluders(part, cones, near)
        project_axis(P, eye, Ts[part], shapes[part], axis)
        for a in range(ALONG):
            z = axis_sample(shapes[part], a)
            if axis[1, 2] + z * axis[2, 2] < NEAR_PLANE_M or is_occluded(Ts[part], axis, z, part, rays, near, n_near):
                continue
            u, v, du, dv = pixel_on_axis(axis, z)
            for s in range(_ACROSS):
                aside = radius * (s - (_ACROSS - 1) / 2)
                x, y = int(np.floor(u + aside * du + 0.5)), int(np.floor(v + aside * dv + 0.5))
                if 0 <= x < width and 0 <= y < height:
                    found[n, 0], found[n, 1] = part - first, bin_of(image, y, x)
                    n += 1
    return n


@njit(**NO_REFCOUNT)
def _cone(eye: Array, T: Array, shape: Array, cone: Array) -> None:
    """Fill the direction to the centre of a part and the angle of the ball around it, (4,)."""
    for i in range(3):
        cone[i] = T[i, 0] * shape[0] + T[i, 1] * shape[1] + T[i, 2] * shape[2] + T[i, 3] - eye[i]
    distance = np.sqrt(cone[0] ** 2 + cone[1] ** 2 + cone[2] ** 2)
    for i in range(3):
        cone[i] /= distance
    cone[3] = np.arcsin(min(1.0, max(shape[3], shape[4], shape[5]) / distance))
    if distance <= max(shape[3], shape[4], shape[5]):  # the eye is in it
        cone[3] = np.pi


@njit(**NO_REFCOUNT)
def _possible_occluders(part: int, cones: Array, near: NDArray[np.int64]) -> int:
    """List the parts that may occlude some of a part; return their number."""
    n = 0
    for p in range(cones.shape[0]):
        apart, most = 0.0, cones[p, 3] + cones[part, 3]
        for i in range(3):
            apart += (cones[p, i] - cones[part, i]) ** 2
        # A chord is no longer than its arc: cones farther apart than this share no ray.
        if apart < most * most and p != part:
            near[n] = p
            n += 1
    return n


VOLUME = ((np.iinfo(np.uint8).max + 1) / BINS) ** 3
"""Volume of a bin, cubic gray levels."""
DOUBT = 0.02
"""Share of arbitrary pixels under a part: a colour that was never seen there is not impossible. With half
and with twice as much, region evidence finds the same limbs (`tests/benchmarks/region_evidence.py --displaced`)."""
_SMOOTHING_BINS = 0.7
"""Standard deviation of the Gaussian that smooths histograms, bins: light and noise move a colour to the next bin.
With half and with twice as much, region evidence finds 26 and 30 of 37 displaced limbs, with this 27, and 2, 3 and 2 of
1,147 others."""


def smoothed(counts: Array) -> Array:
    """Return histograms of colours, (..., BINS^3), smoothed over neighbouring colours."""
    from scipy.ndimage import gaussian_filter  # imported lazily: loading takes 0.1 s

    cubes = np.asarray(counts, dtype=np.float64).reshape(*counts.shape[:-1], BINS, BINS, BINS)
    return np.asarray(gaussian_filter(cubes, _SMOOTHING_BINS, mode="nearest", axes=(-3, -2, -1))).reshape(counts.shape)


def log_density(counts: Array) -> Array:
    """Return the log density of each colour, (..., BINS^3), per cubic gray level, of histograms with some doubt."""
    smooth = smoothed(counts)
    total = smooth.sum(axis=-1, keepdims=True)
    shares = np.where(total > 0, smooth / np.maximum(total, TINY), 1 / BINS**3)
    return np.log(((1 - DOUBT) * shares + DOUBT / BINS**3) / VOLUME)
