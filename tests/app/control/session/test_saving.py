"""A state says "saved" only if the disk has every pose and pin that was shown, on every path that edits."""

import time

import numpy as np
import pytest
from gestures import FRONT, PAGE, drag, drag_on, grab, pixel_of, wait_for

from app.messages.encoding import state as state_message
from tracker.body.dimensions import dimensions_of
from tracker.errors import SessionError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, PoseChange


class Disk:
    """Compares every state that says "saved" with what another program reads from the disk at that moment."""

    def __init__(self, controller):
        self._controller, self.wrong, self.told = controller, [], set()
        self._store = AnnotationStore(controller.session.annotations_path, read_only=True)
        controller.subscribe(self._compare)

    def _compare(self, state):
        saved = state_message(self._controller.session, state).saved
        self.told.add(saved)
        if not saved:
            return
        for person, shown in zip(self._controller.session.people, state.people, strict=True):
            stored = self._store.pose(person.name, state.frame)
            if shown.source is not None and (stored is None or not np.array_equal(stored.values, shown.values)):
                self.wrong.append((state.frame, person.name, shown.source))
        pins = sum(len(self._store.pins(p.name, state.frame)) for p in self._controller.session.people)
        if pins != sum(map(len, state.pins)):
            self.wrong.append((state.frame, "pins"))
        track = state.track
        if track.running and track.at is not None and self._store.pose("person", track.at) is None:
            self.wrong.append((track.at, "tracked"))


def pin(controller):
    at = tuple(pixel_of(controller, "left_wrist"))
    controller.pinning.begin(PAGE, controller.state.frame, FRONT, 0, "left_wrist", at, True)
    controller.pinning.move(PAGE, (at[0] + 5, at[1]))
    controller.pinning.end(PAGE)


def search(controller):
    controller.search.set_settings(TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=4)))
    controller.search.run()
    wait_for(lambda: controller.state.search.message and controller.state.saved)


def bent(controller):
    controller.pose_edits.set_dof(0, 8, 0.3)
    return controller.pose_edits


def fit(controller):
    wait_for(lambda: controller.state.cost_px is not None)
    controller.pinning.fit(2, 0)


def resize(controller):
    controller.body_sizes.set_height(0, dimensions_of(controller.models[0]).height_m + 0.05)
    controller.body_sizes.apply(0, refit=True)


def cancel(controller):
    start = grab(controller, "torso")
    controller.dragging.move(PAGE, tuple(start + 40), 1)
    controller.dragging.cancel(PAGE)


def back_and_forth(controller):
    """A drag that ends where it began."""
    start = grab(controller, "torso")
    values = controller.state.poses[0]
    controller.dragging.move(PAGE, tuple(start + 40), 1)
    session_state = controller.session_state
    session_state.set(people=session_state.people_with_pose(0, values.copy()))
    controller.dragging.end(PAGE)


def undo(controller):
    drag(controller, "torso", (9.0, 0.0))
    controller.history.undo()
    controller.history.redo()
    controller.history.go_to(None)


def alternative(controller):
    session_state = controller.session_state
    record = session_state.saver.record(0, 2)
    other = Alternative(record.values + 0.01, record.model_revision, 1.0)
    session_state.saver.write("track", [PoseChange("person", 2, record, (other,))], None, by_program=False)
    session_state.show_frame(frame=2)
    controller.alternatives.take_alternative(0)


def ranges(controller):
    drag(controller, "torso", (4.0, 0.0))
    drag_on(controller, 6, "torso", (4.0, 0.0))
    controller.ranges.interpolate(2, 6)
    controller.ranges.mark(2, 6, "reviewed")
    controller.navigation.seek(4)
    controller.ranges.toggle_keyframe()
    controller.ranges.clear(2, 6)


EDITS = {
    "drag": lambda c: drag(c, "left_wrist", (10.0, 0.0)), "cancelled drag": cancel, "drag back and forth":
    back_and_forth, "pin": pin, "remove pin": lambda c: (pin(c), c.pinning.remove(2, 0)), "fit": fit, "set": lambda c:
    c.pose_edits.set_dof(0, 8, 0.3), "turn": lambda c: c.pose_edits.turn(0, [8], 0.1), "nudge": lambda c:
    c.pose_edits.nudge(0, "left_wrist", FRONT, 0.02, 0.0), "place": lambda c: c.pose_edits.place_part(0, 0, np.eye(3),
    np.array([0.0, 0.1, 1.0]), "gizmo"), "mirror": lambda c: bent(c).mirror(0), "reset": lambda c: bent(c).reset(0,
    None), "copy": lambda c: (c.navigation.seek(9), c.pose_edits.copy_from(0, 2)), "search": search, "resize": resize,
    "undo": undo, "alternative": alternative, "ranges": ranges
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("edit", EDITS)
def test_saved_is_said_when_it_is_on_the_disk(placed, edit, monkeypatch):
    held = []
    for name in ("commit", "amend"):
        real = getattr(AnnotationStore, name)

        def late(*words, real=real, **more):
            held.append(placed.state)
            time.sleep(0.01)
            return real(*words, **more)

        monkeypatch.setattr(AnnotationStore, name, late)
    disk = Disk(placed)
    EDITS[edit](placed)
    assert disk.wrong == []
    assert placed.state.saved
    shown_before = [s for s in held if s.people[0].source is not None and s.frame == placed.state.frame]
    if edit in ("drag", "pin", "fit", "set", "turn", "nudge", "place", "mirror", "reset", "search"):
        assert shown_before
        assert not any(s.saved for s in shown_before)  # while the commit is held back
        assert disk.told == {True, False}


def test_frames_that_a_tracker_has_not_written_yet_are_not_saved(placed, tracker, monkeypatch):
    monkeypatch.setattr("app.control.tracking.tracking._SAVE_S", 1e9)
    disk = Disk(placed)
    placed.tracking.start(False, 8)
    tracker.let_go(2)
    wait_for(lambda: placed.state.track.done == 2)
    assert not placed.state.saved
    placed.navigation.seek(2)  # writes what the shown frames may need
    assert placed.state.saved
    tracker.let_go(1)
    wait_for(lambda: placed.state.track.done == 3)
    assert placed.state.frame == 2
    assert not placed.state.saved
    tracker.go_on(placed, 1000)
    assert placed.state.saved
    assert disk.wrong == []


def test_an_edit_that_fails_is_not_saved_until_it_is_written(monkeypatch, controller):

    def full(*_, **__):
        raise SessionError("the disk is full; make room")

    with monkeypatch.context() as patch:
        patch.setattr(AnnotationStore, "commit", full)
        disk = Disk(controller)
        drag(controller, "torso", (10.0, 0.0))
        controller.navigation.seek(3)
        assert not controller.state.saved
        assert disk.wrong == []
    controller.history.save()
    assert controller.state.saved
    assert disk.wrong == []


def test_an_edit_is_kept_while_the_store_can_neither_be_read_nor_written(session, monkeypatch, controller):
    drag(controller, "torso", (10.0, 0.0))

    def gone(*_, **__):
        raise SessionError("the drive is gone; plug it in")

    with monkeypatch.context() as patch:
        for name in ("commit", "amend", "pose", "pins", "frames", "history", "alternatives"):
            patch.setattr(AnnotationStore, name, gone)
        drag(controller, "left_wrist", (10.0, 0.0))
        values = controller.state.poses[0]
        assert controller.state.save_error == "the drive is gone; plug it in"
        assert not controller.state.saved
    controller.history.save()
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        np.testing.assert_array_equal(store.pose("person", 0).values, values)
    assert controller.state.undo == "drag left wrist, frame 0"
