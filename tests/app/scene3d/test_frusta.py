"""The cameras in the 3-D view, without a browser."""

import contextlib
from types import SimpleNamespace

import pytest
from gestures import wait_for

from app.scene3d.frusta import Frusta


@pytest.fixture
def shown(opened):
    """A controller of a session with a person, and the frusta of its four cameras."""
    controller, cameras = opened(), []

    def add(name, **_):
        cameras.append(SimpleNamespace(visible=True, image=None, on_click=lambda _: None))
        return cameras[-1]

    scene = SimpleNamespace(add_camera_frustum=add, add_label=lambda name, text: SimpleNamespace(visible=True))
    Frusta(SimpleNamespace(scene=scene, atomic=contextlib.nullcontext), controller)
    wait_for(lambda: all(camera.image is not None for camera in cameras))
    return controller, cameras


def test_faces_are_blurred_while_a_page_does_so(shown):
    controller, cameras = shown
    sharp = [camera.image for camera in cameras]
    for page in (1, 2):
        controller.view_3d.blur_faces(page, True)
    wait_for(lambda: any((camera.image != image).any() for camera, image in zip(cameras, sharp, strict=True)))
    changed = [(camera.image != image).any(axis=2).mean() for camera, image in zip(cameras, sharp, strict=True)]
    assert 0 < max(changed) < 0.1  # heads alone
    controller.view_3d.blur_faces(1, False)
    assert controller.state.pages_blurring_faces == {2}
    controller.view_3d.blur_faces(2, False)
    wait_for(lambda: all((camera.image == image).all() for camera, image in zip(cameras, sharp, strict=True)))


@pytest.mark.slow
def test_pictures_of_the_first_frame_are_there_before_anything_changes(shown):
    """The state is not changed meanwhile: a page that is only looked at shows them, too."""
    _, cameras = shown
    assert len(cameras) == 4
