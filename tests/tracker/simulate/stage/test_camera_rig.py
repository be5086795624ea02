import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.simulate.motion.postures import HEADING_RAD
from tracker.simulate.stage import room
from tracker.simulate.stage.camera_rig import CORNER_NAMES, make_cameras
from tracker.simulate.stage.furniture import HALF_WIDTH_M


@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_cameras_hang_in_the_room_and_look_at_its_middle(n):
    cameras = make_cameras(n, (640, 480), 0)
    for camera in cameras:
        assert np.abs(camera.center_world[:2]).max() < HALF_WIDTH_M
        assert np.allclose(camera.project(np.array([0, 0, 1.0])), (320, 240), atol=25)
        R = camera.T_world_camera[:3, :3]
        assert np.allclose(R @ R.T, np.eye(3))
        assert np.isclose(np.linalg.det(R), 1.0)
        assert R[2, 1] < -0.5  # y points down
    assert len({c.name for c in cameras}) == n


def test_each_corner_camera_sees_the_side_it_is_named_for():
    sides = {"FRONT": 0.0, "LEFT": 90.0, "BACK": 180.0, "RIGHT": -90.0}
    cameras = make_cameras(4, (640, 480), 0)
    assert tuple(c.name for c in cameras) == CORNER_NAMES
    for camera in cameras:
        direction = HEADING_RAD + np.radians(sides[camera.name])
        outward = camera.center_world[:2] / np.linalg.norm(camera.center_world[:2])
        assert outward @ (np.cos(direction), np.sin(direction)) > np.cos(np.radians(20))


@pytest.mark.parametrize("fisheyes", [(), ("all",)])
def test_a_camera_turned_upright_keeps_its_lens(fisheyes):
    for lying, upright in zip(*(make_cameras(4, size, 0, fisheyes) for size in [(640, 480), (480, 640)]), strict=True):
        assert np.allclose(np.diag(upright.K), np.diag(lying.K))


@pytest.mark.parametrize(("n", "size", "found"), [(0, (640, 480), "0"), (4, (641, 480), "641x480")])
def test_impossible_cameras_are_refused(n, size, found):
    with pytest.raises(TrackerError, match=found):
        make_cameras(n, size, 0)


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 4, 6])
def test_nothing_in_the_room_hides_a_person_in_its_middle(n, monkeypatch):
    monkeypatch.setattr(room, "SAMPLES", 1)  # one a pixel will do
    u, v = np.meshgrid(np.linspace(-0.9, 0.9, 7), np.linspace(0.1, 1.8, 7))
    for camera in make_cameras(n, (320, 240), 0):
        # A man-sized screen that faces the camera, arms stretched.
        aside = np.cross(camera.center_world, (0, 0, 1.0))
        screen = u.ravel()[:, None] * aside / np.linalg.norm(aside) + v.ravel()[:, None] * (0, 0, 1.0)
        x, y = np.rint(camera.project(screen)).astype(int).T
        assert np.all(room.see_room(camera, 0).inverse_depths[y, x] < 1.0 / camera.depths(screen))
