"""Region evidence: how much likelier the colours under each part are there than around it, learnt over a run.

In each view and under each part, r is the log ratio of the colours of the part against the background of that place or
the rest of the body. The run itself calibrates it: T(r) = log h1(r) / h0(r), where h1 is the histogram of r under the
part and h0 that around it. A part that looks like its surroundings has a T near 0, so that the table is the trust of
that view for that part. No rule states what is a shadow, a ghost, or a bystander in the same colours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.threads import map_parallel
from tracker.estimation.appearance.background_density import BackgroundDensity
from tracker.estimation.appearance.part_drawing import Canvas, draw_bodies, grown
from tracker.estimation.appearance.region_cells import CellView, cells_of
from tracker.estimation.appearance.region_kernels import RegionTables, add_score
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray
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
