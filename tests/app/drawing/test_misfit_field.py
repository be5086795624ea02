"""Mean shifts in cells of a picture: what pieces say together, and how far arrows are magnified."""

import numpy as np
import pytest

from app.drawing.misfit_field import NO_MISFITS, misfit_field
from tracker.calibration.check.residual_pieces import ResidualPieces

SIZE = (640, 480)
NOTHING = ResidualPieces(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2)))


def pieces(shift, angles_rad, at=(100.0, 100.0)):
    """Pieces of contour of one cell whose edges lie a shift beside them; each sees it along its normal alone."""
    normals = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
    hessians = normals[:, :, None] * normals[:, None, :]
    return ResidualPieces(np.tile(at, (len(normals), 1)), -hessians @ np.asarray(shift), hessians)


def test_pieces_of_all_directions_give_the_whole_shift():
    field = misfit_field([NOTHING, pieces((3.0, -2.0), np.linspace(0, np.pi, 40))], [SIZE, SIZE])
    (arrow,) = field.arrows
    assert (arrow.camera, arrow.u, arrow.v) == (1, 100, 100)
    assert (arrow.du, arrow.dv) == (pytest.approx(3), pytest.approx(-2))
    assert field.factor == 10  # 53 px are a cell


def test_of_contours_that_run_alike_only_the_shift_across_them_is_known():
    (arrow,) = misfit_field([pieces((3.0, -2.0), np.linspace(-0.05, 0.05, 40))], [SIZE]).arrows
    assert (arrow.du, arrow.dv) == (pytest.approx(3, abs=0.1), pytest.approx(0, abs=0.1))


def test_few_pieces_and_those_outside_are_left_out():
    few, outside = pieces((3.0, 0.0), np.linspace(0, 3, 5)), pieces((3.0, 0.0), np.linspace(0, 3, 40), (-9.0, 9.0))
    assert misfit_field([few, outside], [SIZE, SIZE]) == NO_MISFITS._replace(factor=50)
