"""Residuals of a camera that is off, where they are in its picture; those of the others stay small."""

import numpy as np
import pytest
from rig_scenes import CAMERAS, turned, viewed
from staging import posed

from app.drawing.misfit_field import misfit_field
from tracker.calibration.check.residual_pieces import residual_pieces
from tracker.estimation.acquisition.contour_bundle import RigState
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.geometry.camera_correction import FOCAL, N_CORRECTIONS

OFF = 1
FRAMES = range(8)
ZOOMED = np.eye(N_CORRECTIONS)[FOCAL] * 0.03


def arrows_of(correction):
    """Arrows of each camera as position and shift, (n, 4), where one really stands otherwise."""
    frames = viewed({OFF: correction}, FRAMES)
    model = frames[0].bodies[0].model
    corrections = np.zeros((len(CAMERAS), N_CORRECTIONS))
    corrections[OFF] = correction
    parameters = SizeParameters(model)
    state = RigState(corrections, (np.zeros(len(parameters.names)),), tuple(posed(model, k) for k in FRAMES))
    pieces = residual_pieces(frames, [parameters], state)
    field = misfit_field(pieces, [c.size for c in CAMERAS])
    rows = [[(a.u, a.v, a.du, a.dv) for a in field.arrows if a.camera == i] for i in range(len(CAMERAS))]
    return [np.array(own) for own in rows]


@pytest.mark.parametrize(("correction", "field"), [
    (turned(yaw_deg=0.5), lambda x: np.tile([-1.0, 0.0], (len(x), 1))),
    pytest.param(turned(roll_deg=2.0), lambda x: np.stack([x[:, 1], -x[:, 0]], axis=1), marks=pytest.mark.slow),
    pytest.param(ZOOMED, lambda x: x, marks=pytest.mark.slow),
], ids=["a shift", "a whirl", "a star"])  # fmt: skip
def test_a_fault_has_its_field_in_its_picture_alone(correction, field):
    found = arrows_of(correction)
    own = found[OFF]
    shifts, expected = own[:, 2:], field(own[:, :2] - np.array(CAMERAS[OFF].size) / 2)
    cosine = np.sum(shifts * expected) / np.sqrt(np.sum(shifts**2) * np.sum(expected**2))
    assert abs(cosine) > 0.8
    lengths = [np.sqrt(np.mean(np.sum(rows[:, 2:] ** 2, axis=1))) for rows in found]
    assert lengths[OFF] > 3 * max(np.delete(lengths, OFF))


@pytest.mark.slow
def test_the_whirl_of_a_camera_turns_the_other_way_for_the_other_sign():
    one, other = (arrows_of(turned(roll_deg=by))[OFF] for by in (2.0, -2.0))
    turns = [np.sum((x[:, 0] - 320) * x[:, 3] - (x[:, 1] - 240) * x[:, 2]) for x in (one, other)]
    assert turns[0] * turns[1] < 0
