"""A room of two cameras with their videos, of which tests make sessions."""

import numpy as np
import pytest
from clips import SIZE, encode

from tracker.formats.anipose import write_calibration
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.session.assemble import NewSession, assemble

K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])


def place(i):
    """Pose of a camera in a row of nearly parallel ones."""
    return rigid.transform(rigid.so3_exp(np.array([0.0, 0.01 * i, 0.0])), np.array([0.0, i, 1.0]))


@pytest.fixture
def room(tmp_path):
    """A calibration of two cameras and their videos of 9 frames."""
    write_calibration(
        tmp_path / "Calib.toml",
        [Camera(name, SIZE, K, np.zeros(0), place(i)) for i, name in enumerate(("front", "left"))],
    )
    for name in ("front", "left"):
        encode(tmp_path / f"{name}.mp4", n=9)
    return tmp_path


def new(room, **changes):
    settings = {"calibration": room / "Calib.toml", "videos": [room / "left.mp4", room / "front.mp4"]}
    return assemble(NewSession(room / "s", **(settings | changes)))


def noted(room, **changes):
    """A new session, and what a person is told to look at, beside the notes on the axis that points up."""
    notes = []
    settings = {"calibration": room / "Calib.toml", "videos": [room / "left.mp4", room / "front.mp4"]}
    session = assemble(NewSession(**({"folder": room / "s"} | settings | changes)), note=notes.append)
    return session, [sentence for sentence in notes if "axis" not in sentence]


def assert_refused(room, kind, expected, remedy=None, **changes):
    before = sorted(room.iterdir())
    with pytest.raises(kind, match=expected) as caught:
        new(room, **changes)
    assert remedy in (None, caught.value.remedy)
    assert sorted(room.iterdir()) == before  # nothing half-written
