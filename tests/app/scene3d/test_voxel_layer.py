"""The voxels in the 3-D view without a browser: colours of parts, drawn while switched on, a note if there are none."""

import contextlib
from types import SimpleNamespace

import numpy as np
import pytest
from figures import cameras_about_a_figure, figure, silhouettes_of_figure
from gestures import wait_for

from app.drawing.overlay_colors import rgb
from app.scene3d import voxel_layer
from app.scene3d.voxel_layer import VoxelLayer, part_colors
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.figure import figure_of
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34", 1.72)
POSE = MODEL.neutral()
GREY = [150, 150, 150]


def test_a_voxel_has_the_colour_of_its_part():
    state = state_of(MODEL, [POSE], 1.0, VoxelSettings())
    far = np.array([[5.0, 5.0, 5.0]])
    colors = part_colors(np.concatenate([state.centers, far]), [MODEL], [POSE])
    expected = [rgb(MODEL.parts[m[0]].color) for m in figure_of(MODEL).members]
    np.testing.assert_array_equal(colors, [*expected, GREY])


def test_without_a_pose_all_voxels_are_grey():
    colors = part_colors(np.zeros((3, 3)), [MODEL], [None])
    np.testing.assert_array_equal(colors, [GREY] * 3)


class Scene:
    """Stands for viser's scene: what was drawn last by name."""

    def __init__(self):
        self.clouds, self.notes, self.scene = [], [], self

    def atomic(self):
        return contextlib.nullcontext()

    def add_point_cloud(self, name, points, colors, **_):
        assert points.shape == colors.shape
        self.clouds.append(points)

    def add_label(self, name, text, visible):
        self.notes.append(text if visible else "")


class Controller:
    """Stands for the controller."""

    def __init__(self):
        self.session = SimpleNamespace(cameras=(), up="z", floor=None)
        self.frames = SimpleNamespace(observer=SimpleNamespace(recording=None))
        self.state = self.of(voxels=False)

    @staticmethod
    def of(voxels, frame=0, **changes):
        view = SimpleNamespace(voxels=voxels)
        values = {"view_3d": view, "drag": None, "is_3d_throttled": False, "frame": frame, "poses": (POSE,)}
        calibration = SimpleNamespace(n_changes=0)
        return SimpleNamespace(**(values | {"models": (MODEL,), "calibration": calibration} | changes))


@pytest.fixture
def views(monkeypatch):
    """Silhouettes by frame: a person on frame 0, nobody on frame 1."""
    seen = silhouettes_of_figure(figure(noise=0.1)[0], cameras_about_a_figure())
    frames = [seen, [s._replace(mask=np.zeros_like(s.mask)) for s in seen]]
    finder = SimpleNamespace(silhouettes=lambda k: frames[k], close=lambda: None)
    monkeypatch.setattr(voxel_layer, "SilhouetteFinder", lambda cameras, recording: finder)
    monkeypatch.setattr(voxel_layer, "_REST_S", 0.0)


@pytest.mark.slow
def test_voxels_are_drawn_while_they_are_switched_on(views):
    scene, controller = Scene(), Controller()
    layer = VoxelLayer(scene, controller)
    layer.show(controller.of(voxels=True, drag=object()))
    layer.show(controller.of(voxels=True))
    wait_for(lambda: scene.clouds)
    points = scene.clouds[0]
    assert len(points) > 500
    height = figure(noise=0.1)[0].points_world[:, 2]
    np.testing.assert_allclose([points[:, 2].min(), points[:, 2].max()], [height.min(), height.max()], atol=0.1)
    layer.show(controller.of(voxels=False))
    wait_for(lambda: len(scene.clouds) > 1)
    assert [len(c) for c in scene.clouds[1:]] == [0]
    assert scene.notes == ["", ""]


def test_voxels_are_carved_again_by_corrected_cameras(views, monkeypatch):
    scene, controller, made, finder = Scene(), Controller(), [], voxel_layer.SilhouetteFinder
    monkeypatch.setattr(voxel_layer, "SilhouetteFinder", lambda c, r: made.append(c) or finder(c, r))
    layer = VoxelLayer(scene, controller)
    layer.show(controller.of(voxels=True, frame=1))
    wait_for(lambda: scene.clouds)
    controller.session.cameras = ("corrected",)
    layer.show(controller.of(voxels=True, frame=1, calibration=SimpleNamespace(n_changes=1)))
    wait_for(lambda: len(scene.clouds) == 2)
    assert made == [(), ("corrected",)]


def test_a_note_says_why_there_are_no_voxels(views):
    scene, controller = Scene(), Controller()
    layer = VoxelLayer(scene, controller)
    layer.show(controller.of(voxels=True, frame=1))
    wait_for(lambda: scene.notes)
    assert len(scene.clouds[0]) == 0
    expected = "No voxels: expected somebody in the silhouettes of at least 2 views, found none"
    assert [note.startswith(expected) for note in scene.notes] == [True]
