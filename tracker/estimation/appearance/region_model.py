"""Region evidence: how much likelier the colours under each part are there than around it, learnt over a run.

In each view and under each part, r is the log ratio of the colours of the part against the background of that place or
the rest of the body. The run itself calibrates it: T(r) = log h1(r) / h0(r), where h1 is the histogram of r under the
part and h0 that around it. A part that looks like its surroundings has a T near 0, so that the table is the trust of
that view for that part. No rule states what is a shadow, a ghost, or a bystander in the same colours. Some
poses may be wrong: parts that disagree with the others count less.

Region evidence of a finished run: how far each part and limb is below its usual.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.compute.sampling import spread_indices
from tracker.compute.threads import map_parallel
from tracker.estimation.appearance.background_density import BackgroundDensity, learn_background
from tracker.estimation.appearance.part_colors import MAX_NATS, counterparts, log_density
from tracker.estimation.appearance.part_drawing import (
    CELL_PX,
    Canvas,
    CellView,
    cells_of,
    cells_of_image,
    draw_bodies,
    grown,
)
from tracker.estimation.appearance.region_kernels import (
    N_RATIOS,
    RegionTables,
    add_score,
    count_colors,
    count_ratios,
    count_ratios_around,
)
from tracker.evidence.images.color_histogram import BINS
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import TINY, Array, FloatArray, Image, IntArray
from tracker.geometry.cameras import Camera

SAMPLE_M = 0.07
"""Side of an independent sample on the body, metres: nearer cells show the same cloth in the same light."""
REACH_M = 0.25
"""How far around a part its surroundings reach, metres: a limb that is lost lies mostly that near. Regions of evidence
reach as far around the joints, for flesh and the error of a prediction two frames ahead."""
OCCUPIED_M = 0.12
"""Distance from the bodies up to which cells may show people, metres: hair and cloth, and the error of a pose."""


class RegionFrame(NamedTuple):
    """Region evidence of a frame, for all poses that are compared on it."""

    views: tuple[CellView | None, ...]
    """Cells of each view; None without an image."""
    background: tuple[FloatArray, ...]
    """Log density of the colour of each cell as background, (h, w) for each view."""


class RegionScore(NamedTuple):
    """Region evidence of posed bodies on a frame. Parts are counted through all bodies."""

    nats: Array
    """Evidence for each part in each view, (V, P), nats."""
    samples: Array
    """Independent samples of each part that each view shows, (V, P)."""


@dataclass(frozen=True, eq=False)
class RegionModel:
    """The appearance of people and places in a run."""

    models: tuple[BodyModel, ...]
    """All people."""
    backgrounds: tuple[BackgroundDensity, ...]
    """Background of each view."""
    tables: RegionTables
    """Tables of all views: (V, P, ...)."""

    @cached_property
    def by_view(self) -> tuple[RegionTables, ...]:
        """Tables of each view."""
        return self.tables.by_view()

    def frame(self, views: Sequence[ViewEvidence], bodies: Sequence[PosedBody]) -> RegionFrame:
        """Return what region evidence needs of a frame.

        Args:
            views: evidence of each view.
            bodies: rough poses of all people; the exposure is measured beside them.
        """

        def of_view(i: int) -> tuple[CellView | None, FloatArray]:
            cells = cells_of(views[i])
            if cells is None:
                return None, np.zeros((0, 0), np.float32)
            return cells, background_of(self.backgrounds[i], cells, *draw_bodies(bodies, [cells]))

        cells, background = zip(*map_parallel(of_view, range(len(views))), strict=True)
        return RegionFrame(cells, background)

    def nats(self, frame: RegionFrame, bodies: Sequence[PosedBody]) -> float:
        """Return the sum of `score(...).nats`."""
        return float(self.score(frame, bodies).nats.sum())

    def score(self, frame: RegionFrame, bodies: Sequence[PosedBody]) -> RegionScore:
        """Return the evidence of each part in each view, for bodies of the models that were learnt."""
        score = RegionScore(*np.zeros((2, len(frame.views), self.tables.trust.shape[1])))
        shown = [(i, v) for i, v in enumerate(frame.views) if v is not None]
        for (i, view), canvas in zip(shown, draw_bodies(bodies, [v for _, v in shown]), strict=True):
            at = view.colors, canvas, sample_share(view.camera), frame.background[i]
            add_score(*at, self.by_view[i], score.nats[i], score.samples[i])
        return score


def background_of(known: BackgroundDensity, view: CellView, canvas: Canvas) -> FloatArray:
    """Return the log density of each cell as background, (h, w), with the exposure beside the bodies."""
    gain = known.gain(view, ~grown(canvas, OCCUPIED_M * view.camera.K[0, 0]))
    return known.log_density(view, gain)


def sample_share(camera: Camera) -> float:
    """Return the share of a cell in an independent sample at a depth of 1 m, per m^2."""
    return float(1 / (camera.K[0, 0] * camera.K[1, 1] * SAMPLE_M**2))


N_LEARNING = 60
"""Frames from which the appearance of a run is learnt, at most."""
_PRIOR_SAMPLES = 30.0
"""Weight of all views in the colours of a part, and of the whole body in its histograms of r, samples: those of a
forearm in some five frames. With half and with twice as much, 27 of 37 displaced limbs in five recordings are found
(`tests/benchmarks/region_evidence.py --displaced`) as with this; of 1,147 others 2 and 1, with this 2."""
_CLEAR = 1.0
"""Evidence of a sample that is clear, nats. A part whose usual evidence is less counts almost fully on all frames. With
half and with twice as much, the same limbs are found; with 0, clothes in the colours of a wall are trusted."""


class LearningFrame(NamedTuple):
    """A frame of the run that is learnt from."""

    views: Sequence[ViewEvidence]
    """Evidence of each view, with colours."""
    bodies: Sequence[PosedBody]
    """All people, in one order in all frames."""


class _Shown(NamedTuple):
    """A view of a frame with its bodies."""

    frame: int
    """Index among the frames."""
    view: int
    cells: CellView
    canvas: Canvas
    background: FloatArray
    """Log density of the colour of each cell as background, (h, w)."""
    share: float
    """See `sample_share`."""


def learning_frames(frames: Sequence[int]) -> list[int]:
    """Return the frames to learn from, spread evenly over those of a run, ascending."""
    at = spread_indices(len(frames), N_LEARNING)
    return [frames[i] for i in at]


def learn_regions(
    frames: Sequence[LearningFrame], cameras: Sequence[Camera], empty: Sequence[Image | None] = ()
) -> RegionModel:
    """Learn the appearance of people and places.

    Poses may be wrong on some frames. Parts whose evidence is below the usual there count less.

    Args:
        frames: some sixty frames, spread over the run.
        cameras: whole views, in working pixels.
        empty: smoothed empty scene of each view, (H, W, 3), in working pixels, or None; empty without any.
    """
    models = tuple(b.model for b in frames[0].bodies)

    def of_view(i: int) -> tuple[BackgroundDensity, list[_Shown]]:
        cells = [(k, cells_of(f.views[i])) for k, f in enumerate(frames)]
        drawn = [(k, c, draw_bodies(frames[k].bodies, [c])[0]) for k, c in cells if c is not None]
        known = _background(cameras[i], drawn, empty[i] if empty else None)
        shown = [(k, i, c, canvas, background_of(known, c, canvas)) for k, c, canvas in drawn]
        return known, [_Shown(*s, sample_share(s[2].camera)) for s in shown]

    backgrounds, of_views = zip(*map_parallel(of_view, range(len(cameras))), strict=True)
    shown = [s for of_view in of_views for s in of_view]
    weights = np.ones((len(frames), sum(len(m.parts) for m in models)))
    for _ in range(2):  # In the second round, parts count by how far they agree with the first.
        tables = _calibrated(_colors(models, shown, weights, len(cameras)), models, shown, weights)
        weights = _agreement(models, tables, shown, len(frames))
    return RegionModel(models, backgrounds, tables)


def isotonic(values: Array, weights: Array) -> Array:
    """Return the nondecreasing values nearest to others, (n,), in weighted squares: pool adjacent violators."""
    blocks: list[tuple[float, float, int]] = []
    for value, weight in zip(values.tolist(), weights.tolist(), strict=True):
        blocks.append((value, weight, 1))
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            (a, wa, na), (b, wb, nb) = blocks[-2:]
            blocks[-2:] = [((a * wa + b * wb) / (wa + wb), wa + wb, na + nb)]
    return np.repeat([b[0] for b in blocks], [b[2] for b in blocks])


def _background(
    camera: Camera, drawn: Sequence[tuple[int, CellView, Canvas]], empty: Image | None
) -> BackgroundDensity:
    """Learn the background of a view."""
    shape = camera.height // CELL_PX, camera.width // CELL_PX
    occupied = [grown(canvas, OCCUPIED_M * c.camera.K[0, 0]) for _, c, canvas in drawn]
    scene = None if empty is None else cells_of_image(empty)
    return learn_background([c for _, c, _ in drawn], occupied, shape, scene)


def _colors(models: Sequence[BodyModel], shown: Sequence[_Shown], weights: Array, n_views: int) -> RegionTables:
    """Learn the colours of each part in each view, by its weight on each frame, (T, P). T is 0 in these tables."""
    n_parts = weights.shape[1]
    counts = np.zeros((n_views, n_parts, BINS**3))
    for s in shown:
        count_colors(s.cells.colors, s.canvas, s.share, weights[s.frame], counts[s.view])
    twins, of_body = counterparts(models), _bodies_of(models)
    pooled = counts.sum(axis=0)
    pooled = pooled + pooled[twins]
    prior = _PRIOR_SAMPLES * pooled / np.maximum(pooled.sum(axis=-1, keepdims=True), TINY)
    is_rest = of_body[:, None] == of_body
    is_rest[range(n_parts), range(n_parts)] = is_rest[range(n_parts), twins] = False
    rest = is_rest.astype(np.float64) @ counts
    own, others = (log_density(c).astype(np.float32) for c in (counts + prior, rest))
    return RegionTables(own, others, np.zeros((n_views, n_parts, N_RATIOS), np.float32))


def _calibrated(
    tables: RegionTables, models: Sequence[BodyModel], shown: Sequence[_Shown], weights: Array
) -> RegionTables:
    """Return tables with T."""
    under, around = np.zeros(tables.trust.shape), np.zeros(tables.trust.shape)
    by_view = tables.by_view()
    for s in shown:
        own = by_view[s.view]
        count_ratios(s.cells.colors, s.canvas, s.share, s.background, own, weights[s.frame], under[s.view])
        reach = REACH_M * s.cells.camera.K[0, 0]
        count_ratios_around(s.cells.colors, s.canvas, s.share, s.background, own, reach, around[s.view])
    h1, h0 = (_with_prior(h, _bodies_of(models)) for h in (under, around))
    T, samples = np.log(h1 / h0), h1 + h0
    for i, part in np.ndindex(T.shape[:2]):
        T[i, part] = isotonic(T[i, part], samples[i, part])
    return tables._replace(trust=np.clip(T, -MAX_NATS, MAX_NATS).astype(np.float32))


def _with_prior(counts: Array, of_body: IntArray) -> Array:
    """Return smoothed shares of r, (V, P, `N_RATIOS`), shrunk to those of the whole body in all views."""
    from scipy.ndimage import gaussian_filter1d  # imported lazily: loading takes 0.1 s

    smooth = np.asarray(gaussian_filter1d(counts, 1.0, axis=-1, mode="nearest")) + 1e-3
    whole = np.array([smooth[:, of_body == b].sum(axis=(0, 1)) for b in of_body])
    prior = _PRIOR_SAMPLES * whole / whole.sum(axis=-1, keepdims=True)
    return np.asarray((smooth + prior) / (smooth.sum(axis=-1, keepdims=True) + _PRIOR_SAMPLES))


def _agreement(models: Sequence[BodyModel], tables: RegionTables, shown: Sequence[_Shown], n_frames: int) -> Array:
    """Return the weight of each part on each frame, (T, P), which falls with the distance from the usual evidence."""
    nats, samples = np.zeros((2, n_frames, tables.trust.shape[1]))
    by_view = tables.by_view()
    for s in shown:
        own = by_view[s.view]
        add_score(s.cells.colors, s.canvas, s.share, s.background, own, nats[s.frame], samples[s.frame])
    rates = nats / np.maximum(samples, TINY)
    best = usual(rates, models)
    return np.asarray(np.clip(1 - (best - rates) / np.maximum(best, _CLEAR), 0, 1) ** 2)


def _bodies_of(models: Sequence[BodyModel]) -> IntArray:
    """Return the index of the body of each part, (P,)."""
    return np.repeat(np.arange(len(models)), [len(m.parts) for m in models])


_QUARTILES = (25.0, 75.0)
"""Percentiles over the run between which half of the evidence lies. The upper one is usual: on runs that lost a limb
half of the time the median showed it as usual."""


def usual(evidence: Array, models: Sequence[BodyModel]) -> Array:
    """Return the usual evidence of each part, (P,): an upper percentile of that over a run, (T, P), of the better side.

    A limb that is lost during most of a run has a counterpart that is not.
    """
    high = np.percentile(evidence, _QUARTILES[1], axis=0)
    return np.asarray(np.maximum(high, high[counterparts(models)]))


def elsewhere_nats(nats: Array, models: Sequence[BodyModel]) -> Array:
    """Return how much likelier each part is elsewhere than where it is drawn, (T, P), nats.

    Where a part is, its evidence on a frame is normal around its usual, as widely as over the run. Elsewhere it is
    normal around 0, as widely. This is the log ratio of both. A part that looks like its surroundings, and one that is
    often hidden, therefore say little. Each side varies around its own: a leg that is lost in all frames lies below the
    other one, which does not make either vary. Evidence counts as it is, not per visible sample: a limb that is lost
    behind the body loses samples.

    Args:
        nats: evidence in all views, (T, P): `RegionScore.nats` of each frame, summed over the views.
        models: all people.
    """
    best, below = usual(nats, models), nats - np.percentile(nats, _QUARTILES[1], axis=0)
    low, high = np.percentile(np.concatenate([below, below[:, counterparts(models)]]), _QUARTILES, axis=0)
    spread = np.maximum(0.5 * MAD_TO_SIGMA * (high - low), np.sqrt(np.maximum(best, 1.0)))
    return np.asarray(best * (best - 2 * nats) / (2 * spread**2))


def worst_parts(elsewhere: Array, models: Sequence[BodyModel]) -> IntArray:
    """Return the index of the part of each limb of all people that is likeliest elsewhere, (T, n_limbs).

    Args:
        elsewhere: see `elsewhere_nats`, (T, P).
        models: all people.
    """
    columns, first = list[IntArray](), 0
    for model in models:
        columns += [first + limb.parts[elsewhere[:, first + limb.parts].argmax(axis=1)] for limb in limbs(model)]
        first += len(model.parts)
    return np.stack(columns, axis=1)


def worst_views(nats: Array, models: Sequence[BodyModel]) -> IntArray:
    """Return the index of the view in which each part lacks most of its usual evidence there, (T, P).

    Args:
        nats: evidence in each view, (T, V, P).
        models: all people.
    """
    lacks = np.stack([usual(of_view, models) - of_view for of_view in nats.transpose(1, 0, 2)])
    return np.asarray(lacks.argmax(axis=0))
