"""What a hand in the page does to a controller, and waiting for what comes of it."""

import time

import numpy as np

PAGE, FRONT = 1, 0


def wait_for(condition, timeout_s=60.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


def pixel_of(controller, point, camera=FRONT, person=0):
    model = controller.models[person]
    place = model.points_world(controller.state.poses[person])[model.point_names.index(point)]
    return controller.session.cameras[camera].camera.pinhole.project(place)


def grab(controller, point, camera=FRONT, person=0):
    """Take a joint in the hand, and return its pixel."""
    start = pixel_of(controller, point, camera, person)
    controller.dragging.begin(PAGE, camera, person, point, tuple(start))
    return start


def drag(controller, point, by, camera=FRONT, person=0):
    start = grab(controller, point, camera, person)
    for t in (0.5, 1.0):
        controller.dragging.move(PAGE, tuple(start + t * np.array(by)), int(10 * t))
    controller.dragging.end(PAGE)


def drag_on(controller, frame, point, by):
    """Go to a frame, and drag there."""
    controller.navigation.seek(frame)
    drag(controller, point, by)


def start_run(user):
    """Begin to track frames 3 to 6 from a pose that is set by hand on frame 2."""
    drag_on(user, 2, "torso", (4.0, 0.0))
    user.tracking.start(False, 6)
