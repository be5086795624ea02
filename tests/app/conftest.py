"""The command line in this process, and a session to use it on."""

import shutil
import sys
from functools import lru_cache
from pathlib import Path

import pytest
from command_line import SAMPLE
from fake_tracker import FakeTracker
from gestures import drag_on, wait_for

from app.control.controller import Controller
from app.main import main
from app.session.frame_cache import FrameCache
from app.storage.saver import Saver
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.formats.model_toml import format_model
from tracker.interchange.plausibility import examine
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.annotator import VARIABLE

_fits = {}
"""Poses that have been fitted to joints in this process."""

_films = {}
"""People whom frames of the sample have shown in this process."""


def fitted_once(model, targets_world, near=None, centers=False):
    """Fit as `fit_to_points`, but the same joints of the same body only once: it takes half a second."""
    assert near is None
    asked = format_model(model), centers, *((name, place.tobytes()) for name, place in sorted(targets_world.items()))
    if asked not in _fits:
        _fits[asked] = fit_to_points(model, targets_world, centers=centers)
    return _fits[asked]


@pytest.fixture
def film_once(monkeypatch):
    """Look at the sample's footage for what imported points are compared with, but at the same frames only once."""
    film = examine.segment_filmed_people

    def filmed(session, frames):
        asked = session.name, frames.tobytes()
        if asked not in _films:
            _films[asked] = film(session, frames)
        return _films[asked]

    monkeypatch.setattr(examine, "segment_filmed_people", filmed)


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command line in this process; gives exit status, standard output and standard error."""
    monkeypatch.setattr("tracker.pipeline.given_pose.fit_to_points", fitted_once)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))  # nobody is remembered there
    monkeypatch.setenv(VARIABLE, "")

    def run_it(*words):
        monkeypatch.setattr(sys, "argv", ["quadrille", *map(str, words)])
        capsys.readouterr()
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code or 0
        return status, *capsys.readouterr()

    return run_it


@pytest.fixture
def session(tmp_path):
    """A working copy of the sample."""
    return Path(shutil.copytree(SAMPLE, tmp_path / "session"))


class RememberingObserver(Observer):
    """Keeps the evidence of the frames that tests look at most."""

    def evidence(self, k, *asked, **also):
        return super().evidence(k, *asked, **also) if asked or also else self._of_frame(k)

    def forget(self):
        """For tests of what is shown before there is evidence."""
        self._of_frame.cache_clear()

    @lru_cache(maxsize=16)  # noqa: B019 it lives as long as the tests
    def _of_frame(self, k):
        return super().evidence(k)


@pytest.fixture(scope="session")
def observer(tmp_path_factory):
    """The sample's footage, opened once for all tests that only look at it."""
    loaded = load_session(shutil.copytree(SAMPLE, tmp_path_factory.mktemp("footage") / "session"))
    recording = Recording(loaded.cameras)
    yield RememberingObserver(loaded.cameras, recording)
    recording.close()


@pytest.fixture
def opened(session, observer):
    """Open the session; each call is a restart."""
    open_now = []

    def close():
        while open_now:
            controller, store = open_now.pop()
            controller.close()
            store.close()

    def open_it(compiler=None):
        close()
        loaded = load_session(session)
        store = AnnotationStore(loaded.annotations_path)
        frames = FrameCache(observer, rest_s=0)  # no page waits for pictures
        controller = Controller(loaded, Saver(loaded, store), frames, compiler)
        open_now.append((controller, store))
        if compiler is None:  # otherwise there is none before its kernels are compiled
            wait_for(lambda: controller.state.cost_px is not None)
        return controller

    yield open_it
    close()


@pytest.fixture
def controller(opened):
    """The sample, opened once."""
    return opened()


@pytest.fixture
def couple(session, opened):
    """A controller of two people, ann and bob, of whom the sample's footage shows one; nobody has been placed."""
    toml = session / "session.toml"
    row = '    { name = "person", model = "models/person.toml", color = "#53a504" },\n'
    ann = row.replace('"person"', '"ann"', 1)
    bob = row.replace('"person"', '"bob"', 1).replace("#53a504", "#d062f2")
    text = toml.read_text("utf-8")
    assert row in text
    toml.write_text(text.replace(row, ann + bob), "utf-8")
    return opened()


@pytest.fixture
def tracker(monkeypatch):
    """Stands for the tracker: takes its steps when it is let go."""
    return FakeTracker(monkeypatch)


@pytest.fixture
def placed(opened, tracker):
    """A controller whose body stands on frame 2."""
    controller = opened()
    drag_on(controller, 2, "torso", (4.0, 0.0))
    yield controller
    tracker.let_go(1000)  # nobody waits at the end
