"""Region evidence as a residual block: its derivative by a pose is an integral along contours.

The evidence for a body is a sum over the cells that its parts cover. A part whose contour moves outwards gains its
evidence for the cells that it enters, and the part behind it loses its own. Integrated along the visible contours, this
is the derivative of the sum (S. C. Zhu, A. Yuille 1996, IEEE PAMI 18:884). At a right contour the difference falls from
inside to outside, and its slope is the second derivative.

The cost counts whole cells, so that it is rougher than its derivative: a cell is a quarter of an independent sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody, ahead, parts_of
from tracker.estimation.appearance.part_drawing import CELL_PX, CellView, draw, meshes_of
from tracker.estimation.appearance.region_kernels import RegionTables, add_score
from tracker.estimation.appearance.region_model import RegionFrame, RegionModel, sample_share
from tracker.estimation.appearance.region_residual_kernels import add_depth_forces, add_region_pulls
from tracker.estimation.fitting.clocked_residuals import SummedBlocks, at_time
from tracker.estimation.fitting.contour_arrays import Scratch, scratch_buffer
from tracker.estimation.fitting.contour_residuals import equations_of_twists
from tracker.estimation.fitting.gauss_newton import NormalEquations, ResidualBlock
from tracker.estimation.fitting.segment_matching import pack_visible
from tracker.estimation.fitting.twists import add_twists
from tracker.evidence.contours.occluding_contours import contour_room, part_poses, trace_pieces
from tracker.evidence.contours.pieces import PIECE_PX, place_parts
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.geometry.arrays import Array, FloatArray

_PIECE_CELLS = PIECE_PX / CELL_PX
"""Longest piece of contour, cells."""


class _View(NamedTuple):
    """A view of the frame."""

    cells: CellView
    background: FloatArray
    """Log density of the colour of each cell as background, (h, w)."""
    tables: RegionTables
    """Of the view."""
    share: float
    """See `sample_share`."""
    scratch: Scratch
    """For the pieces of its contours."""


@dataclass(frozen=True, eq=False)
class _RegionResiduals:
    """Region evidence for one person in views of one time; see `ResidualBlock`. One thread at a time may use it."""

    views: Sequence[_View]
    bodies: Sequence[PosedBody]
    """All people at that time; the person may be in any pose."""
    person: int
    """Index of the person."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`. The cost is the negative evidence for all people, nats."""
        own = parts_of([b.model for b in self.bodies], self.person)
        Ts = part_poses(self.bodies)
        Ts[own] = kinematics.Ts_world_part
        M, b = np.zeros((len(Ts), 6, 6)), np.zeros((len(Ts), 6))
        nats = sum(self._add(view, Ts, own, M, b) for view in self.views)
        return equations_of_twists(model, kinematics, -nats, M[own], b[own])

    def _add(self, view: _View, Ts: Array, own: slice, M: Array, b: Array) -> float:
        """Add the normal equations of the person's parts in a view; return the evidence for all parts, nats."""
        camera, scratch, models = view.cells.camera, view.scratch, tuple(x.model for x in self.bodies)
        P, eye, surfaces = camera.projection, camera.center_world, surfaces_of(models)
        canvas = draw(meshes_of(models), P, Ts, *view.cells.colors.shape[:2])
        place = view.cells.colors, canvas, view.share, view.background, view.tables
        nats, samples = np.zeros((2, len(Ts)))
        add_score(*place, nats, samples)
        place_parts(Ts, surfaces, scratch.traced)
        trace_pieces(P, eye, surfaces, _PIECE_CELLS, scratch.traced)
        pack_visible(len(Ts), scratch)
        scratch.pulls[:, : scratch.firsts[-1]] = 0.0
        add_region_pulls(own.start, own.stop, *place, P, scratch)
        for part in range(own.start, own.stop):
            span, W = scratch.firsts[part : part + 2], scratch.traced.Ts_world_unit[part]
            add_twists(span, scratch.pieces, scratch.pulls, P, W, eye, False, M[part], b[part])
        add_depth_forces(own.start, own.stop, *place, eye, np.linalg.inv(P[:, :3]), P[2, :3], b)
        return float(nats.sum())


def region_residuals(known: RegionModel, frame: RegionFrame, bodies: Sequence[PosedBody], person: int) -> ResidualBlock:
    """Return the region evidence of a frame for a person, each view at the time of its picture.

    Args:
        known: the appearance of all people.
        frame: the frame.
        bodies: all people; the others stay.
        person: index of the person.
    """
    surfaces, blocks = surfaces_of(tuple(b.model for b in bodies)), list[ResidualBlock]()
    shown = [(i, v) for i, v in enumerate(frame.views) if v is not None]
    for time in sorted({v.ahead_frames for _, v in shown}):
        views = []
        for i, v in shown:
            if v.ahead_frames == time:
                room = contour_room([v.camera], len(bodies), _PIECE_CELLS)
                scratch = scratch_buffer(surfaces, room, 0)
                views.append(_View(v, frame.background[i], known.by_view[i], sample_share(v.camera), scratch))
        own = _RegionResiduals(views, ahead(bodies, time), person)
        blocks.append(at_time(own, bodies[person].velocity, time))
    return SummedBlocks(blocks)
