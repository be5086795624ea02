"""Thumbnails of stored poses: made once, made again for another pose, and not while the page needs the processor."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from gestures import drag, pixel_of

from app.server import thumbnails
from app.session.footage_pictures import FootageCrops
from tracker.footage.camera_source import Clock
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION, corrected


@pytest.fixture
def made(monkeypatch, controller):
    """A controller with a pose on frame 0, its thumbnails, and what has been drawn."""
    drag(controller, "torso", (3.0, 0.0))
    drawn, draw = [], thumbnails.thumbnails.thumbnail

    def counted(*parts):
        drawn.append(parts)
        return draw(*parts)

    monkeypatch.setattr(thumbnails.thumbnails, "thumbnail", counted)
    found = thumbnails.Thumbnails(controller, FootageCrops(controller.session.cameras))
    yield controller, found, drawn
    found.close()


@pytest.mark.slow
def test_a_thumbnail_is_made_once_for_each_pose_and_limb(made):
    controller, found, drawn = made
    first = found.jpeg(0, 0, 1)
    assert first.startswith(b"\xff\xd8")
    assert found.jpeg(0, 0, 1) is first
    assert len(drawn) == 1
    assert found.jpeg(0, 0, None) != first
    assert found.jpeg(0, 0, 99) == found.jpeg(0, 0, None)  # a limb of another body
    assert found.jpeg(0, 0, None, True) != found.jpeg(0, 0, None, False)
    drag(controller, "left_wrist", (30.0, 0.0))
    assert found.jpeg(0, 0, 1) != first
    assert found.jpeg(0, 1, 1) is None  # no pose
    assert found.jpeg(7, 0, 1) is None


def test_a_person_is_drawn_at_the_time_of_the_picture(made):
    controller, found, drawn = made
    found.jpeg(0, 0, None)
    cameras, (body,) = controller.session.cameras, controller.stored_poses.on_frame(0).values()
    assert body.velocity is None
    late = replace(controller.session, cameras=tuple(replace(c, clock=Clock(0.5)) for c in cameras))
    controller.frames.set_cameras = lambda _: None  # the observer is shared by other tests
    controller.session_state.show_frame(frame=1)
    drag(controller, "torso", (30.0, 0.0))  # another pose beside it gives a velocity
    controller.session_state.set_cameras(late)
    assert found.jpeg(0, 0, None)
    (now,), (then,) = drawn[0][3], drawn[-1][3]
    velocity = controller.stored_poses.on_frame(0)[0].velocity
    assert np.abs(velocity).max() > 0
    np.testing.assert_allclose(then.values, now.model.retract(now.values, 0.5 * velocity))
    controller.session_state.set_cameras(replace(controller.session, cameras=cameras))


def test_corrected_cameras_are_followed(made):
    controller, found, drawn = made
    first, cameras = found.jpeg(0, 0, 1), controller.session.cameras
    turn = np.full(N_CORRECTIONS, 0.0)
    turn[ROTATION] = np.radians([0.0, 0.0, 5.0])
    turned = [replace(c, camera=corrected(c.camera, turn)) for c in cameras]
    controller.frames.set_cameras = lambda _: None  # the observer is shared by other tests
    controller.session_state.set_cameras(replace(controller.session, cameras=tuple(turned)))
    assert found.jpeg(0, 0, 1) != first
    used = drawn[-1][1].T_world_camera
    assert any(np.array_equal(used, c.camera.T_world_camera) for c in turned)
    controller.session_state.set_cameras(replace(controller.session, cameras=cameras))
    assert found.jpeg(0, 0, 1) == first


def test_pictures_and_drags_go_first(made):
    controller, found, drawn = made
    controller.dragging.begin(1, 0, 0, "left_wrist", tuple(pixel_of(controller, "left_wrist")))
    worker = threading.Thread(target=found.jpeg, args=(0, 0, 1))
    worker.start()
    time.sleep(0.15)
    assert drawn == []
    controller.dragging.end(1)
    worker.join(10)
    assert len(drawn) == 1
