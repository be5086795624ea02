"""`quadrille index`: what it makes, how it goes on, and that the page looks at it."""

import errno
import os

import numpy as np
import pytest
from command_line import assert_refused, output_of
from gestures import wait_for

from app.session import proxies
from app.session.frame_cache import FrameCache
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.session.session import load_session


@pytest.mark.slow
def test_index_makes_a_proxy_of_every_camera(run, session):
    out = output_of(run("index", session))
    loaded = load_session(session)
    assert all(p is not None and p.n_frames == loaded.n_frames for p in proxies.proxies(loaded))
    assert f"FRONT {loaded.n_frames}" in out
    out = output_of(run("index", session, "--json"))
    assert '"stopped": false' in out


def test_on_a_system_that_is_read_only(run, session, monkeypatch):
    def refused(path, *_, **__):
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr(proxies.Path, "mkdir", refused)
    assert_refused(run("index", session), ["cannot write the proxies into", "Read-only file system; make the session"])


@pytest.mark.parametrize(
    "name",
    ["lock.json", *(pytest.param(n, marks=pytest.mark.slow) for n in ("FRONT.json", "FRONT.index", "FRONT.mjpeg"))],
)
def test_a_named_pipe_in_place_of_a_proxy_does_not_hang_the_program(run, session, name):
    (session / "proxies").mkdir()
    os.mkfifo(session / "proxies" / name)
    assert proxies.proxies(load_session(session)) == [None] * 4
    status, _, err = run("index", session)
    assert status in (0, 1)  # an old proxy is replaced
    assert "Traceback" not in err


@pytest.mark.slow
def test_stopped_it_goes_on(run, session, monkeypatch):
    real, count = proxies.Proxy.make, []

    def make(self, path, footage):
        for done in real(self, path, footage):
            count.append(done)
            if len(count) == 70:
                raise KeyboardInterrupt
            yield done

    monkeypatch.setattr(proxies.Proxy, "make", make)
    status, _, err = run("index", session)
    assert status == 1
    assert "run it again to resume" in err
    loaded = load_session(session)
    assert sum(p.n_frames for p in proxies.proxies(loaded) if p) == 69 - 1
    assert run("index", session)[0] == 0
    assert [p.n_frames for p in proxies.proxies(loaded)] == [loaded.n_frames] * len(loaded.cameras)


@pytest.mark.slow
def test_the_page_looks_at_the_proxy_and_matches_the_footage(run, session, monkeypatch):
    assert run("index", session)[0] == 0
    loaded = load_session(session)
    recording = Recording(loaded.cameras)
    decoded = []
    real = recording._read_one
    monkeypatch.setattr(recording, "_read_one", lambda camera, k: decoded.append(k) or real(camera, k))
    observer = Observer(loaded.cameras, recording)
    frames, plain = FrameCache(observer, proxies.proxies(loaded)), FrameCache(observer)
    try:
        seen = frames.images(31)
        assert decoded == []
        for image, truth in zip(seen, plain.images(31), strict=True):
            assert np.abs(image.astype(int) - truth).mean() < 4
        frames.request(31, lambda _: None)
        wait_for(lambda: frames.cached_evidence(31) is not None)
        assert 31 in decoded
    finally:
        frames.close()
        plain.close()
        recording.close()


def test_a_proxy_of_other_footage_is_not_looked_at(run, session):
    assert run("index", session)[0] == 0
    loaded = load_session(session)
    assert proxies.stale(loaded) == []
    front = next(c.footage for c in loaded.cameras if c.camera.name == "FRONT")
    front.touch()
    assert proxies.stale(loaded) == ["FRONT"]
    assert [p is None for p in proxies.proxies(loaded)].count(True) == 1


@pytest.fixture
def indexed(run, session):
    """An indexed session and its frames, looked at through the proxies."""
    assert run("index", session)[0] == 0
    loaded = load_session(session)
    recording = Recording(loaded.cameras)
    frames = FrameCache(Observer(loaded.cameras, recording), proxies.proxies(loaded))
    yield loaded, frames
    frames.close()
    recording.close()


@pytest.mark.slow
def test_a_proxy_that_vanishes_is_replaced_by_the_footage(indexed, session):
    _, frames = indexed
    assert frames.images(31)[0] is not None
    for path in (session / proxies.FOLDER).glob("*.mjpeg"):
        path.unlink()
    assert all(image is not None for image in frames.images(32))
    assert frames.problem() is None


@pytest.mark.slow
def test_a_proxy_is_not_looked_at_once_its_footage_is_replaced(indexed, session):
    loaded, frames = indexed
    front = next(i for i, c in enumerate(loaded.cameras) if c.camera.name == "FRONT")
    before = frames.images(31)[front]
    loaded.cameras[front].footage.write_bytes((session / "BACK.mp4").read_bytes())
    assert frames.problem() is None  # the same number of frames of the same size
    assert np.abs(frames.images(31)[front].astype(int) - before).mean() > 4
