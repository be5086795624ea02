"""How well a scripted user places people by hand, with the default body, by drags alone; and what one Fit makes of it.

The user goes through the joints from the trunk outwards and through the views in turn, whatever they show, with 3 px of
noise. An action is one drag. The drags are those that the page sends.
"""

import shutil
from contextlib import ExitStack, closing

import numpy as np
import pytest
from gestures import PAGE, pixel_of, wait_for
from program import ROOT
from scripted_user import ORDER, ScriptedUser

from app.control.controller import Controller
from app.session.frame_cache import FrameCache
from app.storage.saver import Saver
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.formats.model_toml import format_model, load_model
from tracker.session.assemble import NewSession, assemble
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

TANGO = ROOT / "sample_sessions" / "tango"
NEAR_ENOUGH_PX = 4
"""Whatever looks nearer than this, nobody drags."""
SEEDS = range(3)
PLACED_MM, FITTED_MM = 60, 40


@pytest.fixture(scope="module")
def tango(tmp_path_factory):
    """The sample with the default body."""
    folder = shutil.copytree(TANGO, tmp_path_factory.mktemp("tango") / "session")
    for model in (folder / "models").glob("*.toml"):
        model.write_text(format_model(load_model("gavrila34")), "utf-8")
    return folder, [folder / "truth_man.trc", folder / "truth_woman.trc"]


@pytest.fixture(scope="module")
def balance(data_folder, tmp_path_factory):
    data = data_folder("balance_real")
    folder = tmp_path_factory.mktemp("balance") / "session"
    videos = sorted(data.glob("cam*.mp4"))
    assemble(NewSession(folder, calibration=data / "Calib.toml", videos=videos, background=data / "background"))
    return folder, [data / "reference_joints.trc"]


class Hand:
    """A user's hand in one session, and how many drags it has made."""

    def __init__(self, controller, user, person):
        self.controller, self.user, self.person, self.actions = controller, user, person, 0
        self._views = 0

    @property
    def values(self):
        return self.controller.state.poses[self.person]

    def place(self):
        for point in ORDER:
            view = self._views % len(self.controller.session.cameras)
            self._views += 1
            start = pixel_of(self.controller, point, view, self.person)
            if point == "torso":
                self._drag(view, point, start, start + self.user.trunk_off_px(self.values, view))
            else:
                self._drag(view, point, start, self.user.aim_px(point, view))

    def _drag(self, view, point, start, end):
        if np.hypot(*(end - start)) < NEAR_ENOUGH_PX:
            return
        self.actions += 1
        dragging = self.controller.dragging
        dragging.begin(PAGE, view, self.person, point, tuple(start))
        for step in (1, 2, 3, 4):
            dragging.move(PAGE, tuple(start + step / 4 * (end - start)), step, is_last=step == 4)
        dragging.end(PAGE)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("recording", ["balance", "tango"])
def test_people_are_placed_by_twenty_drags_and_one_fit(recording, seed, request, tmp_path, record_property):
    source, truths = request.getfixturevalue(recording)
    session = load_session(shutil.copytree(source, tmp_path / "session"))
    with ExitStack() as open_now:
        footage = open_now.enter_context(closing(Recording(session.cameras)))
        store = open_now.enter_context(AnnotationStore(session.annotations_path))
        frames = FrameCache(Observer(session.cameras, footage), rest_s=0)
        controller = open_now.enter_context(closing(Controller(session, Saver(session, store), frames)))
        wait_for(lambda: controller.state.cost_px is not None)
        hands = []
        for person, truth in enumerate(truths):
            user = ScriptedUser(session, truth, 0, seed, range(len(session.cameras)), person)
            hands.append(Hand(controller, user, person))
            hands[-1].place()
        placed = [h.user.error_mm(h.values) for h in hands]
        cost_px = controller.state.cost_px
        controller.pinning.fit(0)
        fitted = [h.user.error_mm(h.values) for h in hands]
        found = f"{[h.actions for h in hands]} actions, {np.round(placed)} mm, {cost_px:.2f} px; "
        found += f"after one Fit {np.round(fitted)} mm, {controller.state.cost_px:.2f} px"
        record_property(f"{recording} {seed}", found)
        assert max(h.actions for h in hands) <= 20
        assert max(placed) <= PLACED_MM
        assert max(fitted) <= FITTED_MM
