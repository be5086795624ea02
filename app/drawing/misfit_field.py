"""Misfit of contours to edges over each picture: the mean shift in cells of the picture, magnified."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.residual_pieces import ResidualPieces

_CELLS = 12
"""Cells along the longer side of a picture: a person who fills it has some four across."""
_FEWEST = 20
"""Fewest pieces of contour, of all frames, that a cell is drawn for: the mean of fewer is noise of an edge."""
_LONGEST = 1.0
"""Cells that the longest arrows, but for a tenth, may span: longer ones would cross each other."""
_KNOWN = 0.2
"""Smallest share of the information across contours that there must be along them for both parts of a shift."""
_FACTORS = (50, 20, 10, 5, 2)
"""Factors of magnification, as rulers have them."""


@dataclass(frozen=True)
class MisfitArrow:
    """The mean shift from contours to edges in a cell of a picture, undistorted px."""

    camera: int
    u: float
    """Mean position of the contours of the cell."""
    v: float
    du: float
    dv: float


class MisfitField(NamedTuple):
    """The arrows of all pictures, and the factor by which they are to be magnified."""

    arrows: tuple[MisfitArrow, ...]
    factor: int


NO_MISFITS = MisfitField((), 1)
"""Without a check there are none."""


def misfit_field(pieces: Sequence[ResidualPieces], sizes: Sequence[tuple[int, int]]) -> MisfitField:
    """Sum up residuals in cells.

    Args:
        pieces: of each camera, of all frames.
        sizes: width and height of each picture, undistorted px.
    """
    arrows: list[MisfitArrow] = []
    longest = []
    for camera, (own, size) in enumerate(zip(pieces, sizes, strict=True)):
        cell = max(size) / _CELLS
        columns, rows = np.floor(own.points_px / cell).astype(int).T
        keys = rows * _CELLS + columns
        for key in np.unique(keys[(columns >= 0) & (columns < _CELLS) & (rows >= 0)]):
            at = keys == key
            if np.count_nonzero(at) < _FEWEST:
                continue
            # Contours that all run alike show only the shift across them: the least one of all that fit.
            shift = -np.linalg.pinv(own.hessians[at].sum(axis=0), rcond=_KNOWN) @ own.gradients[at].sum(axis=0)
            u, v = own.points_px[at].mean(axis=0)
            arrows.append(MisfitArrow(camera, *(round(float(x), 1) for x in (u, v)), *map(_hundredth, shift)))
            longest.append(float(np.linalg.norm(shift)) / cell)
    reach = float(np.quantile(longest, 0.9)) if longest else 0.0
    factor = next((f for f in _FACTORS if f * reach <= _LONGEST), 1)
    return MisfitField(tuple(arrows), factor)


def _hundredth(x: float) -> float:
    return round(float(x), 2)
