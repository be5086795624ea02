"""Masks of detected people: what views agree on is somebody, the rest is unknown."""

from dataclasses import replace

import numpy as np
import pytest
from fake_detector import FakeDetector, box_of
from observed_people import make_session, seen, walking

from tracker.errors import TrackerError
from tracker.footage.image_file import ANYONE, UNKNOWN
from tracker.footage.recording import read_mask
from tracker.interchange.detection.detect import DetectionPlan, detect_people
from tracker.interchange.observations.stored_masks import list_masks, load_masks, mask_users, masks_folder

N = 6


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N, people=("ann",), offsets=(("cam1", 2),))


def run(session, detector, report=lambda *_: None, name="net"):
    return detect_people(session, detector, detector, DetectionPlan(name, "fake", range(N), True), report)


def masks(session, k):
    """The masks of a frame as cameras that use them read them, and the boxes of the person."""
    folder = masks_folder(session, "net_masks")
    return [read_mask(replace(c, masks=folder / c.camera.name), k) for c in session.cameras]


def test_people_of_several_views_are_somebody_and_no_camera_uses_that_by_itself(session):
    points = seen(session, [walking(N)])
    run(session, FakeDetector(points))
    found = load_masks(session, "net_masks")
    assert found.cameras == dict.fromkeys(session.camera_names, N)
    assert (mask_users(session, "net_masks"), list_masks(session)) == ((), ["net_masks"])
    for view, mask in enumerate(masks(session, 3)):
        assert np.array_equal(mask == ANYONE, box_of(points[3, view, 0, :, :2], mask.shape) > 0)
        assert not (mask == UNKNOWN).any()


def test_whom_the_network_misses_in_a_view_is_unknown_there(session):
    points = seen(session, [walking(N)])
    run(session, FakeDetector(points, unseen={(2, 0)}))
    missed = masks(session, 3)[2]
    assert set(np.unique(missed)) == {0, UNKNOWN}
    assert (missed[box_of(points[3, 2, 0, :, :2], missed.shape) > 0] == UNKNOWN).all()


def test_whom_one_view_alone_shows_is_unknown(session):
    points = seen(session, [walking(N), walking(N, (0.9, -0.9, 0.0))])
    run(session, FakeDetector(points, unseen={(v, 1) for v in (0, 1, 3)}))
    ann, bystander = (box_of(points[0, 2, i, :, :2], (480, 640)) > 0 for i in range(2))
    mask = masks(session, 0)[2]  # a frame on which whole pictures are searched
    assert (mask[ann] == ANYONE).all()
    assert (mask[bystander & ~ann] == UNKNOWN).all()


def test_a_detection_that_was_stopped_goes_on_with_its_masks(session):
    detector = FakeDetector(seen(session, [walking(N)]))

    def stop(_, share, *text):
        if share >= 0.5:
            raise KeyboardInterrupt

    run(session, detector, stop)
    assert set(load_masks(session, "net_masks").cameras.values()) == {3}
    assert run(session, detector).is_complete
    assert set(load_masks(session, "net_masks").cameras.values()) == {N}
    masks_folder(session, "other_masks").mkdir(parents=True)
    with pytest.raises(TrackerError, match="other_masks exists already"):
        run(session, detector, name="other")
