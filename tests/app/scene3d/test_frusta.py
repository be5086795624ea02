"""The cameras in the 3-D view, without a browser."""

import contextlib
from types import SimpleNamespace

import pytest
from gestures import wait_for

from app.scene3d.frusta import Frusta


@pytest.mark.slow
def test_pictures_of_the_first_frame_are_there_before_anything_changes(opened):
    """The state is not changed meanwhile: a page that is only looked at shows them, too."""
    cameras = []

    def add(name, **_):
        cameras.append(SimpleNamespace(visible=True, image=None, on_click=lambda _: None))
        return cameras[-1]

    scene = SimpleNamespace(add_camera_frustum=add, add_label=lambda name, text: SimpleNamespace(visible=True))
    Frusta(SimpleNamespace(scene=scene, atomic=contextlib.nullcontext), opened())
    wait_for(lambda: all(camera.image is not None for camera in cameras))
    assert len(cameras) == 4
