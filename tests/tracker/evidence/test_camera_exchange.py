"""Two cameras with each other's footage are noticed by what moves, whatever the background is."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from command_line import SAMPLE

from tracker.evidence.camera_exchange import find_body_exchange, find_exchange
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording
from tracker.formats.calibrations.reading import read_cameras
from tracker.formats.trc import read_trc
from tracker.session.session import load_session

NAMES = ("FRONT", "RIGHT", "BACK", "LEFT")


class Frames:
    """The frames of a recording, read once, as those of cameras in any order."""

    def __init__(self, frames, order=range(4)):
        self.frames, self.order, self.n_frames = frames, tuple(order), 50

    def quick_frames(self, n):
        return np.linspace(0, self.n_frames - 1, n).astype(int).tolist()

    def read(self, k):
        nearest = min(self.frames, key=lambda known: abs(known - k))
        return [self.frames[nearest][i] for i in self.order]


@pytest.fixture(scope="module")
def frames():
    with Recording(load_session(SAMPLE).cameras) as recording:
        return {k: recording.read(k) for k in (0, 16, 32, 49)}


def exchanged(i, j, sources=None, side=True):
    """The order of the footage with two exchanged, and the cameras with their backgrounds."""
    order = [j if k == i else i if k == j else k for k in range(4)]
    sources = list(load_session(SAMPLE).cameras if sources is None else sources)
    if side:
        sources = [replace(s, background=sources[k].background) for s, k in zip(sources, order, strict=True)]
    return order, sources


@pytest.mark.slow
def test_the_right_assignment_passes(frames):
    sources = load_session(SAMPLE).cameras
    damaged = {k: [None, *views[1:]] if k == 16 else views for k, views in frames.items()}
    assert find_exchange(sources, Frames(damaged)) is None
    assert find_exchange(sources[:1], Frames(frames)) is None


@pytest.mark.slow
@pytest.mark.parametrize(("pair", "side"), [((0, 3), True), ((1, 2), False)])
def test_exchanged_footage_is_named(frames, pair, side):
    order, sources = exchanged(*pair, side=side)
    exchange = find_exchange(sources, Frames(frames, order))
    assert exchange is not None
    assert set(exchange.cameras) == {NAMES[i] for i in pair}
    assert exchange.exchanged_coverage > exchange.coverage + 0.1
    assert "seems to be exchanged" in exchange.text


@pytest.mark.slow
def test_a_body_that_is_seen_only_with_two_exchanged(frames):
    points_world = read_trc(SAMPLE / "truth.trc").points[0]
    sources = load_session(SAMPLE).cameras
    assert find_body_exchange(sources, Frames(frames), 0, points_world) is None
    order, exchanged_sources = exchanged(1, 3, side=False)
    assert find_body_exchange(exchanged_sources, Frames(frames, order), 0, points_world) == ("RIGHT", "LEFT")
    beside = points_world + np.array([0.8, 0.3, 0.0])  # the other views do not confirm it
    assert find_body_exchange(sources, Frames(frames), 0, beside) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walk", "balance_real", "two_people", "fast_arms", "board_real"])
def test_recordings(data_folder, name):
    """No right assignment is reported, with all cameras or three; an exchange of the first two is."""
    folder = data_folder(name)
    entries = read_cameras(folder / ("camera_array.toml" if name == "board_real" else "Calib.toml")).entries
    backgrounds = {p.stem: p for p in (folder / "background").glob("*.png")}
    sources = [CameraSource(e.camera(), folder / f"{e.name}.mp4", backgrounds.get(e.name)) for e in entries]
    for some in (sources, *combinations(sources, 3)):
        with Recording(some) as recording:
            assert find_exchange(some, recording) is None
    a, b = sources[:2]
    files = [
        replace(a, footage=b.footage, background=b.background),
        replace(b, footage=a.footage, background=a.background),
    ]
    with Recording([*files, *sources[2:]]) as recording:
        exchange = find_exchange([*files, *sources[2:]], recording)
    assert exchange is not None
    # In a square the exchange across is the same arrangement, turned.
    assert set(exchange.cameras) in ({e.name for e in entries[:2]}, {e.name for e in entries[2:]})
