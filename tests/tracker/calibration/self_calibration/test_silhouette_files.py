"""Silhouettes from masks of other programs, and from footage."""

import cv2
import numpy as np
import pytest
from mask_files import SIZE, person_masks, write_masks

from tracker.calibration.self_calibration import person_files
from tracker.calibration.self_calibration.person_files import FilmedPerson, calibrate_filmed_person
from tracker.calibration.self_calibration.person_silhouettes import Flaw
from tracker.errors import CalibrationError

NAMES = ("cam0", "cam1", "cam2")


@pytest.fixture
def found(monkeypatch):
    """Silhouettes that a calibration begins with, by frame and camera."""
    out = []
    monkeypatch.setattr(person_files, "calibrate_by_silhouettes", lambda rows, *_: out.extend(rows))
    return out


def filmed(folder, images, masks=None, **more):
    """Footage of gray images, (F, V, H, W)."""
    for v, name in enumerate(NAMES):
        (folder / "videos" / name).mkdir(parents=True)
        for k, image in enumerate(images[:, v]):
            cv2.imwrite(str(folder / "videos" / name / f"{k:06d}.png"), image)
    return FilmedPerson(masks, camera_paths={n: folder / "videos" / n for n in NAMES}, **more)


def unreported(*_):
    pass


def test_masks_are_read_in_the_frames_of_the_footage(found, tmp_path):
    masks = person_masks(5, 3)
    files = write_masks(tmp_path / "masks", NAMES, masks)
    calibrate_filmed_person(
        filmed(tmp_path, np.zeros_like(masks), files, offsets={"cam1": 1}, common_frames=True), unreported
    )
    assert [len(row) for row in found] == [3] * 4
    top, bottom = SIZE[1] // 4, SIZE[1] * 3 // 4 - 1
    for k, row in enumerate(found):
        for v, silhouette in enumerate(row):
            left = 4 + k + (v == 1) + 3 * v
            assert silhouette.hull_px.min(axis=0).tolist() == [left, top]
            np.testing.assert_allclose(silhouette.upright_px, [[left + 4.5, top], [left + 4.5, bottom]])


def test_masks_of_several_people_do_not_count(found, tmp_path):
    masks = person_masks(3, 3, people=2)
    masks[0, 0][masks[0, 0] == 2] = 0
    calibrate_filmed_person(
        filmed(tmp_path, np.zeros_like(masks), write_masks(tmp_path / "masks", NAMES, masks)), unreported
    )
    assert [[s.flaw for s in row] for row in found] == [[None, *2 * [Flaw.SEVERAL]], *2 * [3 * [Flaw.SEVERAL]]]


def test_masks_of_a_camera_must_not_lack(tmp_path):
    masks = person_masks(3, 3)
    files = write_masks(tmp_path / "masks", NAMES[:2], masks[:, :2])
    with pytest.raises(CalibrationError, match="key points or masks of each camera, found none of cam2 in"):
        calibrate_filmed_person(filmed(tmp_path, np.zeros_like(masks), files), unreported)


@pytest.mark.slow
def test_footage_shows_silhouettes_by_its_own_background(found, tmp_path):
    size = (160, 120)
    masks = person_masks(9, 3, size)
    for k in range(9):
        masks[k] = np.roll(masks[k], 8 * k, axis=-1)
    room = np.random.default_rng(0).integers(40, 90, masks.shape[1:], np.uint8)
    calibrate_filmed_person(filmed(tmp_path, np.where(masks > 0, np.uint8(200), room[None])), unreported)
    rows, columns = np.nonzero(masks[4, 1])
    hull = found[4][1].hull_px
    np.testing.assert_allclose(hull.min(axis=0), [columns.min(), rows.min()], atol=2)
    np.testing.assert_allclose(hull.max(axis=0), [columns.max(), rows.max()], atol=2)
