"""The dataset folder, read by pycocotools, NumPy and the readers of calibrations."""

import hashlib
import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS
from foreign import projected
from pycocotools.coco import COCO
from stored_motions import filmed, store_motion

from tracker.errors import FormatError, Remedy
from tracker.formats.calibrations.reading import read_cameras
from tracker.interchange.exports.datasets.dataset import write_dataset
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.interchange.exports.views import view_labels
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import MarkChange


@pytest.fixture
def couple(tmp_path):
    """Two people with footage; ann has no pose on frame 2, and frame 1 alone is a keyframe of both."""
    session, truth = store_motion(
        tmp_path / "walk", [MODELS["gavrila38"], MODELS["gavrila22"]], n_frames=4, gaps={(0, 2)}
    )
    return filmed(session, tmp_path), truth


def exported(tmp_path, session, frames=None, only=None, **options):
    folder = tmp_path / "d"
    write_dataset(read_motion(session, (0, 1), frames, only=only), ExportOptions(**options), [folder], lambda: None)
    return folder, folder / "recordings" / "walk"


@pytest.mark.parametrize("pixels", ["original", "undistorted"])
def test_pictures_labels_and_cameras_agree(tmp_path, couple, pixels):
    session, truth = couple
    _, recording = exported(tmp_path, session, range(1, 3), pixels=pixels)
    coco = COCO(str(recording / "labels" / "coco.json"))
    cameras = {
        layout: [e.camera(None) for e in read_cameras(recording / "calibration" / name).entries]
        for layout, name in (("anipose", "anipose.toml"), ("opencv", "opencv.yml"))
    }
    people = coco.getCatIds(["person"])
    n_checked = 0
    for image in coco.loadImgs(coco.getImgIds()):
        picture = cv2.imread(str(recording / image["file_name"]))
        assert picture.shape[:2] == (image["height"], image["width"])
        k = [c.camera.name for c in session.cameras].index(image["camera"])
        bodies = [(i, truth[i][image["frame"]]) for i in (0, 1) if image["frame"] in truth[i]]
        for found in cameras.values():
            np.testing.assert_allclose(found[k].K, cameras["anipose"][k].K, rtol=1e-9)
            assert found[k].is_pinhole == (pixels == "undistorted")
        labels = view_labels([body for _, body in bodies], cameras["anipose"][k])
        rows = coco.loadAnns(coco.getAnnIds(imgIds=image["id"], catIds=people))
        assert {row["track_id"] for row in rows} == {i for i, _ in bodies}
        first = 1
        for i, body in bodies:
            row = next(row for row in rows if row["track_id"] == i)
            expected = (labels >= first) & (labels < first + len(body.model.parts))
            first += len(body.model.parts)
            np.testing.assert_array_equal(coco.annToMask(row) > 0, expected)
            assert row["area"] == expected.sum()
            v, u = expected.nonzero()
            assert row["bbox"] == [u.min(), v.min(), u.max() + 1 - u.min(), v.max() + 1 - v.min()]
            x, y, flag = np.array(row["keypoints"]).reshape(17, 3)[9]  # left wrist
            if flag:
                place = body.named_points_world["left_wrist"]
                np.testing.assert_allclose((x, y), projected(cameras["anipose"][k], place), atol=0.1)
                n_checked += 1
    assert n_checked >= 6
    stored = np.load(recording / "poses.npz")
    assert stored["frames"].tolist() == [1, 2]
    np.testing.assert_allclose(stored["camera_K"][2], cameras["anipose"][2].K, rtol=1e-9)
    assert len([*(recording / "labels" / "openpose").rglob("*.json")]) == len(coco.getImgIds()) == 6


def test_checksums_splits_and_a_card_with_fields_to_fill_in(tmp_path, couple):
    session, _ = couple
    folder, recording = exported(tmp_path, session)
    rows = dict(line.split("  ")[::-1] for line in (folder / "SHA256SUMS").read_text().splitlines())
    files = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    assert rows.keys() == files.keys() - {"SHA256SUMS"}
    assert all(
        rows[name] == hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items() if name in rows
    )
    assert json.loads((folder / "splits.json").read_text()) == {"train": ["walk"], "validation": [], "test": []}
    card = (folder / "README.md").read_text()
    for field in ("Licence", "Consent of the people filmed", "Ethics approval"):
        assert f"| {field} | TO BE FILLED IN |" in card
    assert "| people | 2 |" in card
    assert "| labelled pictures | 12 |" in card
    assert "| keyframes | 2 |" in card
    assert [p["frame"] for p in json.loads((recording / "provenance.json").read_text())["people"]["ann"]] == [0, 1, 3]
    assert (recording / "images" / "cam1" / "000008.jpg").is_file()


def test_people_without_a_label_are_counted(tmp_path, couple):
    session, _ = couple
    with AnnotationStore(session.annotations_path) as store:
        store.commit("mark", [MarkChange("bob", 3, keyframe=True, reviewed=True)])
    folder, recording = exported(tmp_path, session, only="keyframes")
    coco = COCO(str(recording / "labels" / "coco.json"))
    people = coco.getAnnIds(catIds=coco.getCatIds(["person"]))
    labelled = {(coco.loadImgs(a["image_id"])[0]["frame"], a["person"]) for a in coco.loadAnns(people)}
    assert labelled == {(1, "ann"), (1, "bob"), (3, "bob")}
    assert "| people visible in a picture without a label | 3 |" in (folder / "README.md").read_text()


def test_footage_is_copied_as_it_is_on_request(tmp_path, couple):
    session, _ = couple
    video = tmp_path / "first.mp4"
    video.write_bytes(b"a video")
    session = replace(session, cameras=(replace(session.cameras[0], footage=video), *session.cameras[1:]))
    _, recording = exported(tmp_path, session, pictures="video")
    assert (recording / "videos" / "cam0.mp4").read_bytes() == b"a video"
    assert (recording / "videos" / "cam1" / "007.png").is_file()
    assert not (recording / "images").exists()
    shutil.rmtree(tmp_path / "d")
    with pytest.raises(FormatError, match="expected images with undistorted pixels, found video") as caught:
        exported(tmp_path, session, pictures="video", pixels="undistorted")
    assert caught.value.remedy == Remedy("export_images")
