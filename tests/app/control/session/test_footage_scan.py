"""A session whose footage is listed while the page is open already."""

import threading

import pytest
from gestures import wait_for

from app.control.controller import Controller
from app.session.frame_cache import FrameCache
from app.state.progress import FootageState
from app.storage.saver import Saver
from tracker.errors import RecordingError, TrackerError
from tracker.evidence.observer import Observer
from tracker.footage import packet_scan
from tracker.footage.recording import Recording
from tracker.footage.video import VideoFile
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture
def gate(monkeypatch):
    """Keeps the lists back after some twenty frames, until it is set."""
    monkeypatch.setattr(packet_scan, "_EVERY_PACKETS", 20)
    gate, real = threading.Event(), VideoFile._grow

    def grow(self, listed):
        if self.n_frames:
            gate.wait(100)
        real(self, listed)

    monkeypatch.setattr(VideoFile, "_grow", grow)
    yield gate
    gate.set()


@pytest.fixture
def fresh(session, gate):
    """A controller of a session that is opened for the first time."""
    loaded = load_session(session)
    with Recording(loaded.cameras, in_background=True) as recording:
        store = AnnotationStore(loaded.annotations_path)
        controller = Controller(loaded, Saver(loaded, store), FrameCache(Observer(loaded.cameras, recording)))
        yield controller
        gate.set()
        controller.close()
        store.close()


@pytest.mark.slow
def test_listed_frames_are_shown_and_the_rest_follows(fresh, gate):
    wait_for(lambda: fresh.state.cost_px is not None)
    assert 0 < fresh.state.footage.listed < 1
    assert fresh.frames.listed(0)
    last = fresh.session.n_frames - 1
    fresh.navigation.seek(last)
    assert fresh.state.frame == last
    assert not fresh.frames.listed(last)
    with pytest.raises(TrackerError, match="is being indexed"):
        fresh.frames.evidence(last)
    fresh.navigation.seek(3)  # nothing waits for the other frame
    wait_for(lambda: fresh.state.cost_px is not None)
    fresh.navigation.seek(last)
    gate.set()
    wait_for(lambda: fresh.state.cost_px is not None)
    assert fresh.state.frame == last
    wait_for(lambda: fresh.state.footage == FootageState())


@pytest.mark.slow
def test_a_faulty_file_is_named_when_it_is_found(session, monkeypatch):
    def fail(container, where, report=None):
        raise RecordingError(f"{where} is truncated; copy it again")

    monkeypatch.setattr(packet_scan, "list_frames", fail)
    loaded = load_session(session)
    with Recording(loaded.cameras, in_background=True) as recording:
        store = AnnotationStore(loaded.annotations_path)
        controller = Controller(loaded, Saver(loaded, store), FrameCache(Observer(loaded.cameras, recording)))
        wait_for(lambda: controller.state.footage.error is not None)
        assert "is truncated; copy it again" in controller.state.footage.error
        controller.close()
        store.close()
