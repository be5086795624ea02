"""Pins in the program: gestures, the fit that follows, undo, and what is on disk after each."""

import numpy as np
import pytest
from gestures import FRONT, PAGE, drag, pixel_of, wait_for

from tracker.errors import TrackerError
from tracker.estimation.fitting import gauss_newton
from tracker.estimation.posing import pinned_fit
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

RIGHT, BACK = 1, 2


def pin(controller, point, position_px, camera=FRONT, live=False, to_px=None):
    """Click, or press, drag and let go."""
    controller.pinning.begin(PAGE, controller.state.frame, camera, 0, point, tuple(position_px), live)
    for place in () if to_px is None else np.linspace(position_px, to_px, 4):
        controller.pinning.move(PAGE, tuple(place))
    controller.pinning.end(PAGE)


def stored_pins(session, frame=0):
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        pins = store.pins("person", frame)
    return pins


def pins_of(controller):
    """Places of the pins, px, as exactly as they come back through the lens distortion."""
    return {(p.point, p.camera): tuple(np.round(p.position_px, 6).tolist()) for p in controller.state.pins[0]}


def test_a_pin_is_one_entry_and_leaves_the_pose_alone(session, controller):
    values = controller.state.poses[0]
    pin(controller, "left_wrist", (200.25, 150.5))
    assert pins_of(controller) == {("left_wrist", FRONT): (200.25, 150.5)}
    assert controller.state.undo == "set pin left wrist in FRONT, frame 0"
    assert controller.state.point == "left_wrist"
    assert not controller.state.is_pin_held
    assert controller.state.poses[0] is values
    assert controller.state.people[0].source is None  # the pose is still a draft
    assert [(p.point, p.camera) for p in stored_pins(session)] == [("left_wrist", "FRONT")]
    controller.history.undo()
    assert (pins_of(controller), stored_pins(session)) == ({}, [])
    controller.history.redo()
    assert pins_of(controller) == {("left_wrist", FRONT): (200.25, 150.5)}


def test_pins_are_stored_in_pixels_of_the_footage(opened, session):
    controller = opened()
    camera = controller.session.cameras[FRONT].camera
    assert not camera.is_pinhole
    pin(controller, "left_wrist", (60.0, 40.0))
    ((_, _, place),) = stored_pins(session)
    np.testing.assert_allclose(place, camera.distort_points(np.array([60.0, 40.0])), atol=1e-9)
    assert np.linalg.norm(np.subtract(place, (60.0, 40.0))) > 3
    controller = opened()
    assert pins_of(controller) == {("left_wrist", FRONT): (60.0, 40.0)}
    drag(controller, "torso", (3.0, 0.0))  # an edit of something else leaves it as it is
    assert stored_pins(session)[0].position_px == place


@pytest.mark.slow
def test_pins_and_their_history_outlast_a_restart(opened):
    controller = opened()
    pin(controller, "left_wrist", (200.0, 150.0))
    pin(controller, "left_wrist", (210.0, 160.0), camera=RIGHT)
    pin(controller, "left_wrist", (200.0, 150.0), to_px=(230.0, 170.0))
    assert controller.state.undo == "move pin left wrist in FRONT, frame 0"
    controller.navigation.seek(3)
    assert pins_of(controller) == {}
    controller = opened()
    assert pins_of(controller) == {("left_wrist", FRONT): (230.0, 170.0), ("left_wrist", RIGHT): (210.0, 160.0)}
    controller.navigation.seek(3)
    controller.history.undo()
    assert controller.state.frame == 0  # where the pin is that was taken back
    assert pins_of(controller)["left_wrist", FRONT] == (200.0, 150.0)
    controller.history.undo()
    controller.history.undo()
    assert pins_of(controller) == {}
    controller = opened()
    for _ in range(3):
        controller.history.redo()
    assert pins_of(controller)["left_wrist", FRONT] == (230.0, 170.0)


def test_pins_are_removed_one_by_one_by_joint_or_all(session, controller):
    for point in ("left_wrist", "head"):
        for camera in (FRONT, RIGHT):
            pin(controller, point, (200.0, 150.0), camera)
    controller.pinning.remove(0, 0, "left_wrist", RIGHT)
    assert controller.state.undo == "remove pin left wrist in RIGHT, frame 0"
    assert len(stored_pins(session)) == len(pins_of(controller)) == 3
    controller.pinning.remove(0, 0, "head")
    assert set(pins_of(controller)) == {("left_wrist", FRONT)}
    controller.history.undo()
    controller.pinning.remove(0, 0)
    assert controller.state.undo == "remove all pins, frame 0"
    assert (pins_of(controller), stored_pins(session)) == ({}, [])
    controller.history.undo()
    assert len(pins_of(controller)) == 3
    controller.pinning.remove(0, 0, "right_knee")  # has none: nothing happens
    assert controller.state.undo == "remove pin left wrist in RIGHT, frame 0"


@pytest.mark.slow
def test_the_body_follows_a_live_pin_in_one_entry(session, controller):
    drag(controller, "torso", (4.0, 0.0))
    before = controller.state.people[0]
    start = pixel_of(controller, "left_wrist")
    pin(controller, "left_wrist", start, live=True, to_px=start + np.array([30.0, -20.0]))
    assert np.linalg.norm(pixel_of(controller, "left_wrist") - start - (30.0, -20.0)) < 6
    assert controller.state.undo == "set pin left wrist in FRONT, frame 0"
    assert controller.state.people[0].source == "pinned"
    controller.history.undo()
    np.testing.assert_array_equal(controller.state.poses[0], before.values)
    assert pins_of(controller) == {}
    controller.history.redo()
    assert np.linalg.norm(pixel_of(controller, "left_wrist") - start - (30.0, -20.0)) < 6
    assert len(stored_pins(session)) == 1


@pytest.mark.slow
def test_the_end_of_a_live_pin_decides(controller):
    drag(controller, "torso", (4.0, 0.0))
    start = pixel_of(controller, "right_wrist")
    ends = []
    for detour in ((60.0, 10.0), (-50.0, -60.0)):
        controller.pinning.begin(PAGE, 0, FRONT, 0, "right_wrist", tuple(start), True)
        for by in (detour, (12.0, 8.0)):
            controller.pinning.move(PAGE, tuple(start + by))
        ends.append(controller.state.poses[0])
        controller.pinning.cancel(PAGE)
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("checkpoint_s", [60.0, 0.0])
def test_a_cancelled_pin_leaves_nothing(opened, session, monkeypatch, checkpoint_s):
    monkeypatch.setattr("app.control.posing.pinning._CHECKPOINT_S", checkpoint_s)
    controller = opened()
    drag(controller, "torso", (4.0, 0.0))
    values, start = controller.state.poses[0], pixel_of(controller, "left_wrist")
    controller.pinning.begin(PAGE, 0, FRONT, 0, "left_wrist", tuple(start), True)
    controller.pinning.move(PAGE, tuple(start + 20.0))
    assert len(stored_pins(session)) == (checkpoint_s == 0.0)  # a long drag is on disk before it ends
    controller.pinning.cancel(PAGE)
    np.testing.assert_array_equal(controller.state.poses[0], values)
    assert (pins_of(controller), stored_pins(session)) == ({}, [])
    assert controller.state.undo == "drag torso, frame 0"
    assert not controller.state.is_pin_held


def test_another_page_cannot_move_what_this_one_holds(controller):
    controller.pinning.begin(PAGE, 0, FRONT, 0, "head", (100.0, 100.0), False)
    controller.pinning.move(PAGE + 1, (200.0, 200.0))
    controller.pinning.end(PAGE + 1)
    assert controller.state.is_pin_held
    assert pins_of(controller) == {("head", FRONT): (100.0, 100.0)}


@pytest.mark.slow
@pytest.mark.parametrize("interruption", ["seek", "drag", "undo", "fit"])
def test_whatever_comes_in_between_ends_and_saves_the_gesture(session, interruption, controller):
    drag(controller, "torso", (4.0, 0.0))
    controller.pinning.begin(PAGE, 0, FRONT, 0, "head", (100.0, 100.0), False)
    {
        "seek": lambda: controller.navigation.seek(3),
        "drag": lambda: drag(controller, "left_knee", (3.0, 3.0)),
        "undo": controller.history.undo,
        "fit": lambda: controller.pinning.fit(0),
    }[interruption]()
    assert not controller.state.is_pin_held
    assert len(stored_pins(session)) == (interruption != "undo")
    controller.pinning.move(PAGE, (200.0, 200.0))  # too late
    assert ("head", FRONT) not in pins_of(controller) or pins_of(controller)["head", FRONT] == (100.0, 100.0)


def test_a_pin_outside_of_the_image_is_refused_kindly(controller):
    with pytest.raises(TrackerError, match=r"within the 640x480 px of FRONT, found it at \(700, 20\)"):
        pin(controller, "head", (700.0, 20.0))
    pin(controller, "head", (630.0, 20.0), to_px=(700.0, -50.0))  # a drag stops at the border
    assert pins_of(controller)["head", FRONT] == (639.5, -0.5)


def test_fit_says_who_determined_what(session, controller):
    drag(controller, "torso", (4.0, 0.0))
    cost_px = controller.state.cost_px
    for camera in (FRONT, RIGHT):
        place = pixel_of(controller, "left_wrist", camera) + 5.0
        pin(controller, "left_wrist", place, camera)
    controller.pinning.fit(0)
    assert controller.state.undo == "fit to pins and edges, frame 0"
    assert controller.state.cost_px < cost_px
    assert controller.state.people[0].source == "pinned"
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        pose = store.pose("person", 0)
    by_name = dict(zip(controller.models[0].value_names, pose.sources, strict=True))
    assert by_name["left_elbow.extension"] == "pinned"
    assert by_name["right_knee.extension"] == "fitted"
    assert pose.keyframe
    assert "match" in pose.settings
    np.testing.assert_array_equal(pose.values, controller.state.poses[0])


def test_fit_without_pins_is_to_the_edges(controller):
    drag(controller, "torso", (4.0, 0.0))
    cost_px = controller.state.cost_px
    controller.pinning.fit(0)
    assert controller.state.undo == "fit to edges, frame 0"
    assert controller.state.people[0].source == "fitted"
    assert controller.state.cost_px < cost_px
    assert controller.stored_poses.timeline()[0]["keyframe"]  # a person asked for it


def test_fit_without_edges_is_to_the_pins(monkeypatch, controller):
    monkeypatch.setattr(controller.frames, "cached_evidence", lambda _: None)
    with pytest.raises(TrackerError, match="no pin on this frame"):
        controller.pinning.fit(0)
    target = pixel_of(controller, "left_wrist") + np.array([20.0, -10.0])
    pin(controller, "left_wrist", target)
    controller.pinning.fit(0)
    assert controller.state.undo == "fit to pins, frame 0"
    assert np.linalg.norm(pixel_of(controller, "left_wrist") - target) < 1


def test_fit_leaves_locked_degrees_of_freedom_alone(controller):
    drag(controller, "torso", (4.0, 0.0))
    locked = [
        i for i, n in enumerate(controller.models[0].dof_names) if n.startswith(("left_shoulder", "root", "right"))
    ]
    controller.dof_locks.set(0, locked, True)
    before = controller.state.poses[0]
    pin(controller, "left_wrist", pixel_of(controller, "left_wrist") + 30.0)
    controller.pinning.fit(0)
    moved = np.flatnonzero(controller.state.poses[0] != before)
    assert len(moved)
    assert not set(moved) & set(locked)


@pytest.mark.slow
def test_a_live_pin_costs_a_few_steps_of_the_solver_a_move(opened, monkeypatch):
    """Some 40 ms on a quiet machine of two cores."""
    controller, iterations = opened(), []
    drag(controller, "torso", (4.0, 0.0))

    def counted(*arguments, **options):
        fit = gauss_newton.solve(*arguments, **options)
        iterations[-1].append(fit.iterations)
        return fit

    monkeypatch.setattr(pinned_fit, "solve", counted)
    start = pixel_of(controller, "left_wrist")
    controller.pinning.begin(PAGE, 0, FRONT, 0, "left_wrist", tuple(start), True)
    for i in range(12):
        iterations.append([])
        controller.pinning.move(PAGE, tuple(start + i))
    controller.pinning.end(PAGE)
    assert max(len(each) for each in iterations) <= 3  # by the pins, then by the edges from far and from near
    assert np.median([sum(each) for each in iterations]) < 60


@pytest.mark.slow
def test_pins_belong_to_the_frame_that_a_tracker_shows(placed, tracker):
    controller = placed
    pin(controller, "head", (100.0, 100.0))
    controller.tracking.start(False, 4)
    tracker.let_go(1000)
    wait_for(lambda: controller.state.frame == 4 and not controller.state.track.running)
    assert pins_of(controller) == {}
    controller.navigation.seek(2)
    assert pins_of(controller) == {("head", FRONT): (100.0, 100.0)}


def test_fit_vouches_for_the_pinned_and_leaves_doubts_about_others(couple, session, opened):
    store = AnnotationStore(session / "annotations.sqlite")
    doubtful = {"status": "doubtful", "remark": "left arm relocated"}
    rows = [
        PoseChange(name, 0, PoseRecord(values, ("tracked",) * len(values), revision, **doubtful))
        for name, values, revision in zip(("ann", "bob"), couple.state.poses, couple.state.revisions, strict=True)
    ]
    store.commit("track", rows)
    store.close()
    controller = opened()
    pin(controller, "left_wrist", pixel_of(controller, "left_wrist") + 3.0)
    controller.pinning.fit(0)
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        ann, bob = store.pose("ann", 0), store.pose("bob", 0)
    assert (ann.keyframe, ann.status) == (True, "")
    assert (bob.keyframe, bob.status, bob.remark) == (False, "doubtful", "left arm relocated")
    assert (controller.state.people[1].source, controller.state.people[1].status) == ("fitted", "doubtful")
