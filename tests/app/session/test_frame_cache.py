"""Pictures of the footage for the page."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from app.session import frame_cache


def test_a_picture_has_the_size_asked_for_and_is_made_once(opened, monkeypatch):
    frames = opened().frames
    read = []
    real = frames._read
    monkeypatch.setattr(frames, "_read", lambda frame, camera: read.append((frame, camera)) or real(frame, camera))
    pictures = [frames.image(9, 1, reduction) for reduction in (1.0, 1.6, 3.0, 1.6)]
    assert read == [(9, 1)] * 3
    assert pictures[1] is pictures[3]
    whole, smaller, small, _ = (cv2.imdecode(np.frombuffer(p, np.uint8), cv2.IMREAD_COLOR_RGB) for p in pictures)
    assert [p.shape[:2] for p in (whole, smaller, small)] == [(480, 640), (300, 400), (160, 213)]
    undistorted = frames.images(9)[1]
    assert np.abs(whole.astype(int) - undistorted).mean() < 4
    for picture in (smaller, small):
        simple = cv2.resize(undistorted, picture.shape[1::-1], interpolation=cv2.INTER_AREA)
        assert np.abs(picture.astype(int) - simple).mean() < 5


@pytest.fixture
def clocked(opened, monkeypatch):
    """Frames whose evidence is noted with its time, by a clock that sleep advances; and what does the work."""
    now, made, work = [100.0], [], []
    frames = opened().frames
    frames._rest_s = 0.2
    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + s))
    monkeypatch.setattr(frame_cache, "time", clock)
    monkeypatch.setattr(frames._pool, "submit", work.append)
    monkeypatch.setattr(frames, "evidence", lambda frame: made.append((frame, now[0] - 100.0)))

    def request(frame, at):
        """Request a frame at a time, s, with all work until then done, if the clock has not passed it."""
        now[0] = 100.0 + at
        frames.request(frame, lambda _: None)

    yield request, lambda: [one() for one in work] and made
    monkeypatch.undo()


def test_evidence_of_frames_that_pass_waits_longer_than_they_are_shown(clocked):
    request, done = clocked
    request(1, 0.0)
    request(2, 0.3)
    request(3, 0.6)  # a busy machine plays three frames a second
    assert done() == [(3, pytest.approx(1.2, abs=0.1))]


def test_evidence_of_a_frame_that_is_asked_for_again_or_after_a_while_comes_soon(clocked):
    request, done = clocked
    request(1, 0.0)
    request(2, 0.6)
    request(2, 0.61)
    assert done()[0] == (2, pytest.approx(0.81, abs=0.1))
