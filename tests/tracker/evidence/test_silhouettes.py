from dataclasses import replace

import cv2
import numpy as np
import pytest
from fisheye import with_fisheye

from tracker.evidence.images.background_subtraction import SHADOWS
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import ANYONE, UNKNOWN
from tracker.footage.recording import Recording
from tracker.geometry.cameras import Camera

W, H, N = 320, 240, 9
K = np.array([[200.0, 0.0, 159.5], [0.0, 200.0, 119.5], [0.0, 0.0, 1.0]])


def texture():
    levels = cv2.resize(np.random.default_rng(0).integers(70, 160, (24, 32, 3)).astype(np.uint8), (W, H))
    return levels.astype(np.float64)


def person(i):
    mask = np.zeros((H, W), bool)
    mask[40:200, 30 + 25 * i : 70 + 25 * i] = True
    return mask


def shadow(i):
    return np.roll(person(i), 40, axis=1)


def scene(i):
    """A person in red who moves right, with a shadow behind and a highlight above."""
    image = texture()
    image[shadow(i)] *= 0.7
    image[10:30, 100:200] *= 1.2
    image[person(i)] = (220, 30, 40)
    return image.round().astype(np.uint8)


@pytest.fixture
def camera(tmp_path):
    footage = tmp_path / "cam"
    footage.mkdir()
    for i in range(N):
        cv2.imwrite(str(footage / f"{i:03d}.png"), scene(i)[..., ::-1])
    cv2.imwrite(str(tmp_path / "empty.png"), texture().round().astype(np.uint8)[..., ::-1])
    lens = np.array([-0.1, 0.02, 0.0, 0.0])
    return CameraSource(Camera("cam", (W, H), K, lens, np.eye(4)), footage, background=tmp_path / "empty.png")


def found(camera, k=4, **more):
    with Recording([camera]) as recording:
        (silhouette,) = SilhouetteFinder([camera], recording, **more).silhouettes(k)
    return silhouette


def jaccard(a, b):
    return np.count_nonzero(a & b) / np.count_nonzero(a | b)


def test_shadows_and_highlights_are_background(camera):
    silhouette = found(camera)
    assert jaccard(silhouette.mask, person(4)) > 0.9
    assert silhouette.source == "background"
    assert silhouette.quality > 0.9
    # Without the bound for highlights the lit wall counts.
    assert found(camera, shading=SHADOWS).mask[15:25, 120:180].mean() > 0.5


def test_pixels_are_as_filmed(camera):
    silhouette = found(camera)
    assert silhouette.mask.shape == (H, W)
    wide = found(replace(camera, camera=with_fisheye(camera.camera)))
    np.testing.assert_array_equal(wide.mask, silhouette.mask)
    assert wide.camera.fisheye
    assert np.array_equal(silhouette.camera.distortion, camera.camera.distortion)


@pytest.mark.slow
def test_the_recording_itself_gives_the_background(camera):
    silhouette = found(replace(camera, background=None))
    assert jaccard(silhouette.mask, person(4)) > 0.9
    assert silhouette.source == "recording"


def test_a_finder_of_some_of_the_views_reads_their_footage(camera, tmp_path):
    (tmp_path / "empty").mkdir()
    for i in range(N):
        cv2.imwrite(str(tmp_path / "empty" / f"{i:03d}.png"), texture().round().astype(np.uint8))
    other, camera = replace(camera, footage=tmp_path / "empty"), replace(camera, background=None)
    with Recording([other, camera]) as recording:
        (silhouette,) = SilhouetteFinder([camera], recording, recording_views=[1]).silhouettes(4)
    assert jaccard(silhouette.mask, person(4)) > 0.9


def test_masks_come_first_and_may_be_numbered(camera, tmp_path):
    masks = tmp_path / "masks"
    masks.mkdir()
    numbers = np.zeros((H, W), np.uint8)
    numbers[10:30, 10:30], numbers[50:70, 50:70], numbers[90:110, 90:110] = 1, 2, 255
    cv2.imwrite(str(masks / "000004.png"), numbers)
    masked = replace(camera, masks=masks)
    silhouette = found(masked)
    assert np.array_equal(silhouette.mask, numbers > 0)
    assert (silhouette.source, silhouette.quality) == ("mask", 1.0)
    with Recording([masked]) as recording:
        (second,) = SilhouetteFinder([masked], recording).silhouettes(4, person=1)
        (other,) = SilhouetteFinder([masked], recording).silhouettes(3)
    assert np.array_equal(second.mask, numbers >= 2)
    assert other.source == "background"
    assert found(replace(masked, background=None), k=3).source == "none"  # not the recording's own background


def test_unknown_pixels_of_a_mask_are_neither_person_nor_background(camera, tmp_path):
    labels = np.zeros((H, W), np.uint8)
    labels[10:30, 10:30], labels[50:70, 50:70], labels[30:50, 30:50] = 1, ANYONE, UNKNOWN
    cv2.imwrite(str(tmp_path / "000004.png"), labels)
    masked = replace(camera, masks=tmp_path)
    for person, people in ((None, (1, ANYONE)), (0, (1, ANYONE)), (1, (ANYONE,))):
        with Recording([masked]) as recording:
            (silhouette,) = SilhouetteFinder([masked], recording).silhouettes(4, person)
        assert np.array_equal(silhouette.mask, np.isin(labels, people))
        assert np.array_equal(silhouette.shadow, labels == UNKNOWN)


def test_an_empty_scene_has_no_silhouette(camera, tmp_path):
    (camera.footage / "009.png").write_bytes((tmp_path / "empty.png").read_bytes())
    assert found(camera, k=9).is_empty


def test_a_damaged_frame_shows_nobody(camera):
    (camera.footage / "004.png").write_bytes(b"no image")
    silhouette = found(camera)
    assert silhouette.is_empty
    assert silhouette.source == "none"


@pytest.mark.slow
def test_large_footage_is_reduced(tmp_path):
    footage = tmp_path / "cam"
    footage.mkdir()
    for name, image in (("0.png", scene(2)), ("empty.png", texture().astype(np.uint8))):
        path = footage / name if name == "0.png" else tmp_path / name
        cv2.imwrite(str(path), cv2.resize(image, (4 * W, 4 * H), interpolation=cv2.INTER_CUBIC)[..., ::-1])
    large = Camera("cam", (4 * W, 4 * H), K * np.array([[4], [4], [1]]), np.zeros(0), np.eye(4))
    silhouette = found(CameraSource(large, footage, background=tmp_path / "empty.png"), k=0)
    assert silhouette.mask.shape == (480, 640) == silhouette.camera.size[::-1]
    assert jaccard(silhouette.mask, cv2.resize(person(2).astype(np.uint8), (640, 480)) > 0) > 0.9


def test_learning_the_background_can_be_broken_off(camera):
    read = []

    def step():
        read.append(len(read))
        if len(read) == 3:
            raise InterruptedError

    with Recording([camera]) as recording, pytest.raises(InterruptedError):
        SilhouetteFinder([replace(camera, background=None)], recording, step=step)
    assert len(read) == 3
