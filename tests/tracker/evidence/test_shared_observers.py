"""Observers that share what does not depend on a prediction."""

import numpy as np
import pytest

from tracker.evidence import observer as observing
from tracker.evidence.observer import Observer
from tracker.evidence.shared_observers import shared_observers
from tracker.footage.recording import Recording
from tracker.session.session import load_session

BOX = (100, 80, 420, 400)


@pytest.fixture
def observer(sample_folder):
    session = load_session(sample_folder)
    with Recording(session.cameras) as recording:
        yield Observer(session.cameras, recording)


def test_they_see_what_observers_of_their_own_see(observer):
    for own, chosen in zip(shared_observers(observer, [[1, 2], [0, 2]]), ([1, 2], [0, 2]), strict=True):
        plain = observer.with_cameras(chosen)
        for one, other in zip(own.evidence(5, [BOX, None]), plain.evidence(5, [BOX, None]), strict=True):
            assert one.camera.name == other.camera.name
            np.testing.assert_array_equal(one.points_px, other.points_px)
            np.testing.assert_array_equal(one.distance, other.distance)
            np.testing.assert_array_equal(one.silhouette.inside, other.silhouette.inside)


def test_a_region_that_several_ask_for_is_searched_once(observer, monkeypatch):
    searched, detect_edges = [], observing.detect_edges
    monkeypatch.setattr(observing, "detect_edges", lambda *a: searched.append(1) or detect_edges(*a))
    read, recording = [], observer.recording
    monkeypatch.setattr(recording, "read", lambda k, *a: read.append(k) or Recording.read(recording, k, *a))
    groups = [[i for i in range(4) if i != out] for out in range(4)]
    shared = shared_observers(observer, groups)
    for frame in (5, 6):
        for own in shared:
            own.evidence(frame, [BOX] * 3)
    assert len(searched) == 2 * 4
    assert read == [5, 6]
    shared[0].evidence(6, [None] * 3)  # another region
    assert len(searched) == 2 * 4 + 3


def test_an_error_reaches_all_who_ask(observer, monkeypatch):
    shared = shared_observers(observer, [[0, 1], [1, 2]])

    def fail(*_):
        raise OSError("no frame")

    monkeypatch.setattr(observer.recording, "read", fail)
    for own in shared:
        with pytest.raises(OSError, match="no frame"):
            own.evidence(3)
