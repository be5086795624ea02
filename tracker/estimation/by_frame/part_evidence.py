"""Compare what each view shows of each part of a pose with what it usually shows in the run.

A status says that a limb may be off; this says which part and which view contradict it. Three measures do: the colours
(`tracker.estimation.appearance.region_model`), the share of the part outside the silhouette, and the distance of its
contour to the edges. The run itself says what is usual. Parts are counted through all people.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.compute.progress import Report, unreported
from tracker.estimation.appearance.part_drawing import cells_of, draw_bodies
from tracker.estimation.appearance.region_model import LearningFrame, RegionModel, RegionScore, learn_regions
from tracker.estimation.by_frame.frame_problem import Bodies
from tracker.estimation.fitting.clocked_residuals import person_residuals
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.tracking.view_regions import read_views
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence, with_colors_only
from tracker.geometry.arrays import Array

_CONTRADICTING_NATS = 2 * CLEAR_NATS
"""Evidence below the usual from which a part in a view contradicts a pose, nats: 400 to 1."""


class SeenFrame(NamedTuple):
    """Measures of posed bodies in the views of a frame."""

    views: tuple[ViewEvidence, ...]
    """Colours alone."""
    bodies: Bodies
    outside: Array
    """Share of each part outside the silhouette, (V, P); NaN without a silhouette, and where the part is hidden."""
    contour_px: Array
    """Mean distance of the contour of each part to the edges, (V, P), px of the footage; NaN where it is hidden."""
    thetas_px: Array
    """Outlier distance of each view, (V,), px of the footage."""


class PartTable(NamedTuple):
    """Measures of each part of one person in each view; NaN where the view does not show the part, or not that."""

    below: Array
    """Evidence of the colours below the usual of as many samples, (V, n_parts), nats; negative where it is above."""
    below_in_all: Array
    """Evidence of the colours in all views below the usual, (n_parts,), nats. A part that is hidden lacks it, too."""
    outside: Array
    """Share of the part outside the silhouette, (V, n_parts)."""
    usual_outside: Array
    """Its median over the run, (V, n_parts)."""
    contour_px: Array
    """Mean distance of the part's contour to the edges, (V, n_parts), px of the footage."""
    usual_contour_px: Array
    """Its median over the run, (V, n_parts), px."""


class Contradiction(NamedTuple):
    """The part and the view that contradict a pose most."""

    part: int
    """Index among the parts of the person."""
    view: int | None
    """Index of the view; None for all together."""
    sentence: str
    """As text for people, such as `left calf: 80% outside the person in LEFT`."""


@dataclass(frozen=True, eq=False)
class UsualEvidence:
    """The usual of a run: its colours, and the medians of all measures."""

    known: RegionModel
    """Appearance of the people and places."""
    rates: Array
    """Median evidence of each part, (V, P), nats per sample; NaN where no frame shows it."""
    nats: Array
    """Evidence of each part in all views on each frame that was learnt from, (T, P), nats."""
    outside: Array
    """Median share of each part outside the silhouette, (V, P)."""
    contour_px: Array
    """Median distance of the contour of each part, (V, P), px of the footage."""

    def table(self, seen: SeenFrame, person: int) -> PartTable:
        """Return the table of one person, given by index, on a frame with the same people."""
        score = self.known.score(self.known.frame(seen.views, seen.bodies), seen.bodies)
        is_shown = _is_shown(score)
        below, outside, contour_px = (
            np.where(is_shown, cells, np.nan)
            for cells in (self.rates * score.samples - score.nats, seen.outside, seen.contour_px)
        )
        parts, total = parts_of(self.known.models, person), score.nats.sum(axis=0)
        return PartTable(
            below[:, parts], (np.median(self.nats, axis=0) - total)[parts], outside[:, parts],
            self.outside[:, parts], contour_px[:, parts], self.contour_px[:, parts],
        )  # fmt: skip


def read_frame(observer: Observer, frame: int, bodies: Bodies) -> SeenFrame:
    """Read a frame around posed bodies."""
    views = read_views(observer, frame, bodies)
    return SeenFrame(
        tuple(map(with_colors_only, views)), bodies, np.array([_outside(v, bodies) for v in views]),
        np.concatenate([_contours_px(views, bodies, i) for i in range(len(bodies))], axis=1),
        np.array([v.theta_px / v.scale for v in views]),
    )  # fmt: skip


def learn_usual_evidence(
    observer: Observer, frames: Sequence[tuple[int, Bodies]], report: Report = unreported
) -> UsualEvidence:
    """Learn what is usual from some sixty frames of a run, which may have some wrong poses.

    Args:
        observer: of the recording.
        frames: frames with all people, in one order and in the same bodies.
        report: shows progress. An exception that it raises ends the work.
    """
    seen = []
    for k, (frame, bodies) in enumerate(frames):
        report("reading frames", k / (len(frames) + 1))
        seen.append(read_frame(observer, frame, bodies))
    report("learning the colours", len(frames) / (len(frames) + 1))
    learning = [LearningFrame(s.views, s.bodies) for s in seen]
    known = learn_regions(learning, observer.working_cameras, observer.empty_scenes())
    scores = [known.score(known.frame(s.views, s.bodies), s.bodies) for s in seen]
    is_shown = np.array([_is_shown(s) for s in scores])
    samples, nats = (np.array([getattr(s, name) for s in scores]) for name in ("samples", "nats"))
    rates = np.divide(nats, samples, out=np.full_like(nats, np.nan), where=is_shown)
    outside, contour_px = (
        np.where(is_shown, [getattr(s, name) for s in seen], np.nan) for name in ("outside", "contour_px")
    )
    medians = [_medians(cells) for cells in (rates, outside, contour_px)]
    return UsualEvidence(known, medians[0], nats.sum(axis=1), *medians[1:])


def contradiction(model: BodyModel, table: PartTable, thetas_px: Array, views: Sequence[str]) -> Contradiction | None:
    """Return the part and the view that contradict a pose most; None where nothing does clearly.

    Colours decide, because nats can be compared between parts and views. Contours do where colours say nothing.

    Args:
        model: the body.
        table: of its pose.
        thetas_px: outlier distance of each view, (V,), px of the footage.
        views: names of the views.
    """
    names, below = [display_name(p.name) for p in model.parts], np.nan_to_num(table.below)
    if below.max() > _CONTRADICTING_NATS:
        view, part = _largest(below)
        return Contradiction(part, view, f"{names[part]}: {_off(table, view, part)} in {views[view]}")
    hidden = np.where(np.isnan(table.below).all(axis=0), table.below_in_all, 0.0)
    if hidden.max() > _CONTRADICTING_NATS:
        part = int(hidden.argmax())
        return Contradiction(part, None, f"{names[part]}: hidden in all views, which usually show it")
    excess = np.nan_to_num(table.contour_px - table.usual_contour_px)
    view, part = _largest(excess / thetas_px[:, None])
    if excess[view, part] > ACCEPTED_SHARE * thetas_px[view]:
        px, often = table.contour_px[view, part], table.usual_contour_px[view, part]
        sentence = f"{names[part]}: contour {px:.0f} px from edges in {views[view]}, usually {often:.0f} px"
        return Contradiction(part, view, sentence)
    return None


def _is_shown(score: RegionScore) -> NDArray[np.bool_]:
    """Return whether each view shows as much as one independent sample of each part, (V, P)."""
    return np.asarray(score.samples >= 1.0)


def _off(table: PartTable, view: int, part: int) -> str:
    """Return how the part differs in a view, for people to read."""
    outside = table.outside[view, part]
    if not outside - table.usual_outside[view, part] > 0.1:  # also where one is unknown
        return "its colours are not there"
    return "outside the person" if outside > 0.5 else f"{outside:.0%} outside the person"


def _largest(cells: Array) -> tuple[int, int]:
    """Return the view and the column of the largest cell, (V, n)."""
    view, column = np.unravel_index(int(cells.argmax()), cells.shape)
    return int(view), int(column)


def _outside(view: ViewEvidence, bodies: Sequence[PosedBody]) -> Array:
    """Return the share of each part outside the silhouette of a view, (P,)."""
    n, silhouette, cells = sum(len(b.model.parts) for b in bodies), view.silhouette, cells_of(view)
    if silhouette is None or cells is None:
        return np.full(n, np.nan)
    labels = draw_bodies(bodies, [cells])[0].labels.ravel()
    inside = cells_of(with_colors_only(view, np.repeat(np.uint8(255) * silhouette.inside[..., None], 3, axis=2)))
    assert inside is not None  # of the same region
    total = np.bincount(labels, minlength=n + 1)[1:].astype(np.float64)
    apart = np.bincount(labels, 1 - inside.colors[..., 0].ravel() / 255, minlength=n + 1)[1:]
    return np.divide(apart, total, out=np.full(n, np.nan), where=total > 0)


def _contours_px(views: Sequence[ViewEvidence], bodies: Bodies, person: int) -> Array:
    """Return the mean distance of the contour of each part of a person, (V, n_parts), px of the footage."""
    costs = person_residuals(views, bodies, person).part_costs(bodies[person].values)
    has_edges = np.array([len(v.points_px) > 0 for v in views])[:, None]
    return np.where(has_edges, costs.forward_px / np.array([v.scale for v in views])[:, None], np.nan)


def _medians(rows: Array) -> Array:
    """Return the medians of the known values over frames, (T, ...); NaN where none is known."""
    out = np.full(rows.shape[1:], np.nan)
    for at in np.ndindex(out.shape):
        column = rows[(slice(None), *at)]
        if np.isfinite(column).any():
            out[at] = np.median(column[np.isfinite(column)])
    return out
