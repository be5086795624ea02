import re

import numpy as np
import pytest

from app.remedies import command_line_text
from tracker.evaluation.stored_evaluation import distance_note, length_note
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import MarkerTable, axes_matrix
from tracker.geometry import rigid


def table(change=lambda points: points):
    """Joints of a person who walks, moved by a change."""
    rng = np.random.default_rng(1)
    points = rng.normal(0, 0.3, (1, 12, 3)) + [2.0, 0.5, 1.0] + np.linspace(0, 1, 20)[:, None, None] * [0.0, 1.0, 0.0]
    return MarkerTable(LIMB_JOINTS, np.arange(20), np.arange(20) / 30, change(points + 0.0), 30.0)


def moved(points):
    return rigid.apply(rigid.transform(rigid.so3_exp(np.array([0.3, 0.4, 1.0])), np.array([4.0, 5.0, 6.0])), points)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda p: p @ axes_matrix("y,z,x"), "m from the poses .*with --axes y,z,x it would be 0[.]00 m"),
        (lambda p: 1000 * p, "1000 times as large; correct the Units"),
        (lambda p: p / 1000, "1000 times smaller; correct the Units"),
        (moved, "say --align rigid-all"),
        (lambda p: p[::-1, ::-1] * [1.0, -2.0, 1.5] + 4, "check that it is of this recording"),
    ],
)
def test_a_reference_metres_away(change, expected):
    note = distance_note(table(), table(change), range(20))
    assert note is not None
    assert re.search(expected, command_line_text(*note)), note


def test_axes_are_said_with_respect_to_the_file():
    """Read with wrong axes, the note names the right ones."""
    wrong = table(lambda p: p @ axes_matrix("y,z,x") @ axes_matrix("-y,x,z").T)
    _, remedy = distance_note(table(), wrong, range(20), axes="-y,x,z")
    assert remedy.fields["axes"] == "y,z,x"


def test_a_reference_that_fits():
    assert distance_note(table(), table(lambda p: p + 0.3), range(20)) is None
    assert distance_note(table(), table(lambda p: p + np.nan), range(20)) is None
    assert length_note(20, 20) is None
    assert length_note(20, None) is None
    assert "20 frames and the reference 25" in length_note(20, 25)


def walk(frames, offset_m=0.0, lag=0):
    """Joints that go on at 1.2 m/s at 25 Hz and swing, some frames late and a constant offset ahead."""
    t = (np.asarray(frames) - lag) / 25
    swing = 0.25 * np.sin(6 * t[:, None] + np.arange(12))[..., None] * [0.0, 1.0, 0.3]
    places = np.random.default_rng(2).normal(0, 0.3, (12, 3)) + 1.2 * t[:, None, None] * [0.0, 1.0, 0.0]
    return MarkerTable(LIMB_JOINTS, np.asarray(frames), t, places + swing + [0.0, offset_m, 0.0], 25.0)


def test_a_constant_offset_is_no_lag():
    """Joints of another convention lie some centimetres ahead of a person who walks, on every frame."""
    assert distance_note(walk(range(60)), walk(range(60), offset_m=0.08), range(60)) is None


@pytest.mark.parametrize("frames", [range(60), [k for k in range(90) if k not in (0, 3)]])
def test_a_lag_of_a_reference_is_named(frames):
    """Frames that are missing at the start move nothing: steps are counted in frames."""
    note = distance_note(walk(frames), walk(frames, offset_m=0.05, lag=2), frames)
    assert note is not None
    assert "2 frames" in note[0]
