"""Thumbnails of stored poses: made once, made again for another pose, and not while the page needs the processor."""

import threading
import time

import pytest
from gestures import drag, pixel_of

from app.page import thumbnails
from app.session.footage_crops import FootageCrops


@pytest.fixture
def made(opened, monkeypatch):
    """A controller with a pose on frame 0, its thumbnails, and what has been drawn."""
    controller = opened()
    drag(controller, "torso", (3.0, 0.0))
    drawn, draw = [], thumbnails.thumbnails.thumbnail

    def counted(*parts):
        drawn.append(parts)
        return draw(*parts)

    monkeypatch.setattr(thumbnails.thumbnails, "thumbnail", counted)
    found = thumbnails.Thumbnails(controller, FootageCrops(controller.session.cameras))
    yield controller, found, drawn
    found.close()


def test_a_thumbnail_is_made_once_for_each_pose_and_limb(made):
    controller, found, drawn = made
    first = found.jpeg(0, 0, 1)
    assert first.startswith(b"\xff\xd8")
    assert found.jpeg(0, 0, 1) is first
    assert len(drawn) == 1
    assert found.jpeg(0, 0, None) != first
    assert found.jpeg(0, 0, 99) == found.jpeg(0, 0, None)  # a limb of another body
    drag(controller, "left_wrist", (30.0, 0.0))
    assert found.jpeg(0, 0, 1) != first
    assert found.jpeg(0, 1, 1) is None  # no pose
    assert found.jpeg(7, 0, 1) is None


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
