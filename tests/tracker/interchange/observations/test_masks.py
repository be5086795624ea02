"""Masks of other programs: read, checked, stored with the session, used by its cameras, and left again."""

import json
import re

import cv2
import numpy as np
import pytest
from mask_files import SIZE, coco_data, person_masks, segmentation_of, write_coco_masks, write_masks
from observed_people import make_session
from PIL import Image

from tracker.errors import FormatError, SessionError, TrackerError
from tracker.footage.image_file import UNKNOWN
from tracker.footage.recording import read_mask
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored_masks import list_masks, load_masks, mask_users, masks_folder
from tracker.session.relink import Places, leave_masks, relink
from tracker.session.session import load_session

N = 4
MASKS = person_masks(N, 4)


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N, people=("ann", "bob"), size=SIZE)


def planned(session, path, name="net", **choices):
    return plan_import(session, ImportRequest(name, (path,), ("ann", "bob"), **choices))


def problems(plan):
    return " | ".join(map(str, plan.problems))


def stored(session, path, **choices):
    plan = planned(session, path, **choices)
    assert not plan.problems, problems(plan)
    store_import(session, plan)
    return load_session(session.folder)


def read(session):
    """All masks that the cameras of a session use, (n_frames, n_views, H, W)."""
    return np.array([[read_mask(c, k) for c in session.cameras] for k in range(session.n_frames)])


@pytest.mark.parametrize("mode", ["L", "1", "P", "RGB", "I;16", "LA", "RGBA", "cut out"])
def test_masks_of_each_kind_are_stored_and_used(session, tmp_path, mode):
    found = stored(session, write_masks(tmp_path / "m", session.camera_names, MASKS, mode=mode))
    assert np.array_equal(read(found), np.where(MASKS > 0, 255, 0))
    assert list_masks(found) == ["net"]
    described = load_masks(found, "net")
    assert (described.format, mask_users(found, "net")) == ("masks", session.camera_names)
    assert dict(described.cameras) == dict.fromkeys(session.camera_names, N)
    assert (len(described.sources), described.sources[0].path) == (4 * N, "cam0/cam0_000000.png")
    assert not [p for p in (session.folder / "observations").iterdir() if p.name.startswith(".")]


@pytest.mark.parametrize("of", ["polygon", "runs", "text"])
def test_segmentations_of_coco_are_stored_and_used(session, tmp_path, of):
    if of == "text":
        pytest.importorskip("pycocotools")
    found = stored(session, write_coco_masks(tmp_path / "c.json", session.camera_names, MASKS, of))
    masks, truth = read(found) > 0, MASKS > 0
    assert (masks & truth).sum() == truth.sum()
    near = cv2.dilate(truth[0, 0].astype(np.uint8), np.ones((3, 3))) > 0  # OpenCV fills the border of a polygon
    assert not (masks[0, 0] & ~(near if of == "polygon" else truth[0, 0])).any()


def test_text_of_run_lengths_is_read_as_pycocotools_wrote_it(session, tmp_path):
    pytest.importorskip("pycocotools")
    noise = (np.random.default_rng(3).random((N, 4, *SIZE[::-1])) < 0.4).astype(np.uint8)
    noise[:, :, :, 50:] = 0
    found = stored(session, write_coco_masks(tmp_path / "c.json", session.camera_names, noise, "text"))
    assert np.array_equal(read(found) > 0, noise > 0)


def test_values_tell_people_apart(session, tmp_path):
    masks = person_masks(N, 4, people=3) * 20
    folder = write_masks(tmp_path / "m", session.camera_names, masks)
    plan = planned(session, folder)
    assert "people of values 20, 40, 60 are not told from each other" in plan.notes
    found = stored(session, folder, values={"bob": 20, "ann": 60})
    assert np.array_equal(read(found), np.select([masks == 20, masks == 40, masks == 60], [2, 255, 1]))


def test_a_value_may_be_that_of_what_is_unknown(session, tmp_path):
    masks = person_masks(N, 4, people=3) * 20
    masks[:, :, :4][masks[:, :, :4] == 0] = 40
    folder = write_masks(tmp_path / "m", session.camera_names, masks)
    found = stored(session, folder, values={"bob": 20, "unknown": 40})
    assert np.array_equal(read(found), np.select([masks == 20, masks == 40, masks == 60], [2, UNKNOWN, 255]))
    masks[masks == 0] = 40  # nothing is known to be background
    folder = write_masks(tmp_path / "n", session.camera_names, masks)
    assert not problems(planned(session, folder, name="n", values={"unknown": 40}))
    assert "expected background in each mask" in problems(planned(session, folder, name="n", values={"bob": 40}))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"ann": 3}, "the value 3 for 'ann', found 1, 2; correct the values"),
        ({"ann": 1, "bob": 1}, "another value for each person, found one twice"),
    ],
)
def test_values_that_do_not_fit(session, tmp_path, values, expected):
    folder = write_masks(tmp_path / "m", session.camera_names, person_masks(N, 4, people=2))
    assert expected in problems(planned(session, folder, values=values))
    with pytest.raises(TrackerError, match="unknown person 'eve'"):
        planned(session, folder, values={"eve": 1})


def test_a_matte_is_cut_at_half(session, tmp_path):
    ramp = np.zeros((N, 4, *SIZE[::-1]), np.uint8)
    ramp[..., 10:30, 10:30] = np.linspace(1, 255, 400).reshape(20, 20)
    plan = planned(session, write_masks(tmp_path / "m", session.camera_names, ramp))
    assert any("values are opacities" in note for note in plan.notes)
    store_import(session, plan)
    assert np.array_equal(read(load_session(session.folder)), np.where(ramp > 127, 255, 0))


@pytest.mark.parametrize(("name", "first"), [("{k:06d}.png", 0), ("frame{k}_mask.png", 1), ("{camera}-{k:04d}.png", 1)])
def test_the_last_number_in_a_name_is_the_picture(tmp_path, name, first):
    session = make_session(tmp_path / "s", N, offsets=[("cam2", 1)], size=SIZE)
    masks = person_masks(N + 1, 4)
    for v, camera in enumerate(session.camera_names):
        own = masks[: N + (camera == "cam2"), v]
        write_masks(tmp_path / "m" / str(v), [camera], np.concatenate([own[:1]] * first + [own])[:, None], name)
        if first:
            (tmp_path / "m" / str(v) / camera / name.format(camera=camera, k=0)).unlink()
    plan = plan_import(session, ImportRequest("net", (tmp_path / "m",), ("ann",)))
    assert not plan.problems, problems(plan)
    found = store_import(session, plan)
    expected = np.stack([masks[(v == 2) : (v == 2) + N, v] for v in range(4)], axis=1)
    assert np.array_equal(read(found) > 0, expected > 0)


def test_a_first_frame_places_masks_and_leaves_out_others(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    plan = planned(session, folder, first_frame=2)
    assert "camera 'cam0': 2 pictures lie outside of the session and were left out" in plan.notes
    found = store_import(session, plan)
    assert [read_mask(found.cameras[0], k) is None for k in range(N)] == [True, True, False, False]
    assert np.array_equal(read_mask(found.cameras[1], 3) > 0, MASKS[1, 1] > 0)
    assert sorted(p.name for p in found.cameras[1].masks.iterdir()) == ["000002.png", "000003.png"]


def test_an_offset_takes_frames_off(session, tmp_path):
    plan = planned(session, write_masks(tmp_path / "m", session.camera_names, MASKS), offsets={"cam1": 1})
    assert "camera 'cam1': 1 pictures lie outside of the session and were left out" in plan.notes
    found = store_import(session, plan)
    assert [read_mask(found.cameras[1], k) is None for k in range(N)] == [False, False, False, True]
    assert np.array_equal(read_mask(found.cameras[1], 0) > 0, MASKS[1, 1] > 0)


def test_missing_masks_are_named_and_are_no_masks(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    (folder / "cam1" / "cam1_000002.png").unlink()
    plan = planned(session, folder)
    assert plan.notes == ("camera 'cam1': no picture for frames 2; such frames count as without a mask",)
    found = store_import(session, plan)
    assert read_mask(found.cameras[1], 2) is None
    assert read_mask(found.cameras[1], 3) is not None


def test_an_image_of_coco_without_people_is_an_empty_mask(session, tmp_path):
    masks = MASKS.copy()
    masks[1, 0] = 0
    plan = planned(session, write_coco_masks(tmp_path / "c.json", session.camera_names, masks))
    assert plan.notes == ("camera 'cam0': nobody in the masks of frames 1",)
    assert not read_mask(store_import(session, plan).cameras[0], 1).any()


def test_masks_of_another_size_are_refused_or_scaled(session, tmp_path):
    small = person_masks(N, 4, (40, 30))
    folder = write_masks(tmp_path / "m", session.camera_names, small)
    plan = planned(session, folder)
    assert "a mask of 80x60 pixels, found 40x30" in str(plan.problems[0])
    assert len(plan.problems) == 4
    found = stored(session, folder, picture_size=(40, 30))
    assert np.array_equal(read(found) > 0, small.repeat(2, axis=2).repeat(2, axis=3) > 0)


@pytest.mark.parametrize("of", ["polygon", "runs"])
def test_coco_of_another_size_is_refused(session, tmp_path, of):
    masks = person_masks(N, 4, (40, 30))
    plan = planned(session, write_coco_masks(tmp_path / "c.json", session.camera_names, masks, of))
    assert "image 1: expected a mask of 80x60 pixels, found 40x30" in str(plan.problems[0])


def damaged(folder, what):
    path = folder / "cam1" / "cam1_000002.png"
    if what == "colour":
        rng = np.random.default_rng(0)
        Image.fromarray(rng.integers(0, 255, (*SIZE[::-1], 3), np.uint8)).save(path)
    elif what == "palette":
        image = Image.fromarray(MASKS[2, 1], "P")
        image.putpalette([255, 255, 255, 0, 0, 0])
        image.save(path)
    elif what == "text":
        path.write_text("no image")
    elif what == "opacity":
        Image.fromarray(np.dstack([MASKS[2, 1], 200 * MASKS[2, 1]]), "LA").save(path)
    elif what == "full":
        Image.fromarray(np.full(SIZE[::-1], 255, np.uint8)).save(path)
    elif what == "empty":
        for k in range(N):
            Image.fromarray(np.zeros(SIZE[::-1], np.uint8)).save(path.with_name(f"cam1_{k:06d}.png"))
    elif what == "fewer":
        path.with_name("cam1_000003.png").unlink()
    elif what == "camera":
        (folder / "cam1").rename(folder / "other")
        for file in (folder / "other").iterdir():
            file.rename(file.with_name(file.name[5:]))


@pytest.mark.parametrize(
    ("what", "expected"),
    [
        ("colour", "camera 'cam1'.*one value a pixel, found a colour picture; export it as a grey or palette image"),
        ("palette", r"camera 'cam1'.*black or transparent as colour 0 of the palette.*found \(255, 255, 255\)"),
        ("text", "camera 'cam1'.*damaged or no PNG image; export it again"),
        ("opacity", "masks of one kind, found some by the opacity of a picture"),
        ("full", "camera 'cam1': expected background in each mask, found none on frames 2, where"),
        ("empty", "camera 'cam1': expected people in the masks, found nobody in all 4; export them again, or leave"),
        ("fewer", r"camera 'cam1': expected the 4 pictures of the footage.*found numbers 0 to 2 \(3 pictures\)"),
        ("camera", r"expected the name of a camera \(cam0, cam1, cam2, cam3\) in .*other, found other"),
    ],
)
def test_masks_that_do_not_fit_are_named_and_not_stored(session, tmp_path, what, expected):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    damaged(folder, what)
    plan = planned(session, folder)
    assert len(plan.problems) == 1, problems(plan)
    assert re.search(expected, str(plan.problems[0])), problems(plan)
    with pytest.raises(TrackerError, match=re.escape(str(plan.problems[0]))):
        store_import(session, plan)
    assert not (session.folder / "observations").exists()
    assert load_session(session.folder).cameras[0].masks is None


@pytest.mark.parametrize(
    ("segmentation", "expected"),
    [
        ([[1, 2, 3]], "x and y of three corners or more"),
        ([[1, 2, 3, 4, 5, 6, 7]], "x and y of each corner, found 7 numbers"),
        ([[1, 2, 3, 4, 5, 1e7]], "pixels of at most 32767"),
        ({"size": [60, 80], "counts": [5, 7]}, "run lengths of 4800 pixels, found others"),
        ({"size": [60, 80], "counts": "é"}, "run lengths of 4800 pixels, found others"),
        ({"size": [60, 80], "counts": "o" * 300}, "run lengths of 4800 pixels, found others"),
        ({"size": [60, 80], "counts": -1}, "expected"),
        ("mask.png", "expected"),
    ],
)
def test_malformed_segmentations(session, tmp_path, segmentation, expected):
    data = coco_data(session.camera_names, MASKS)
    data["annotations"][N]["segmentation"] = segmentation
    (tmp_path / "c.json").write_text(json.dumps(data))
    assert re.search(f"camera 'cam1': .*{expected}", problems(planned(session, tmp_path / "c.json")))


def test_only_the_category_of_people_is_taken(session, tmp_path):
    data = coco_data(session.camera_names, MASKS)
    ball = data["annotations"][0] | {"category_id": 2, "segmentation": [[0, 0, 9, 0, 9, 9]]}
    data["annotations"].append(ball)
    data["categories"].append({"id": 2, "name": "ball"})
    (tmp_path / "c.json").write_text(json.dumps(data))
    plan = planned(session, tmp_path / "c.json")
    assert plan.notes == ("segmentations of 'ball' and other categories were left out",)
    assert not read_mask(store_import(session, plan).cameras[0], 0)[:9, :9].any()
    data["categories"][0]["name"] = "dancer"
    (tmp_path / "c.json").write_text(json.dumps(data))
    with pytest.raises(FormatError, match="a category named 'person' among several, found 'dancer', 'ball'"):
        planned(session, tmp_path / "c.json", "other")
    with pytest.raises(SessionError, match=r"observations/net exists already; choose another name"):
        planned(session, tmp_path / "c.json")


def test_a_file_with_both_holds_key_points_unless_masks_are_asked_for(session, tmp_path):
    points = [40, 30, 2] * 17
    path = write_coco_masks(tmp_path / "c.json", session.camera_names, MASKS, keypoints=points, score=0.9)
    plan = planned(session, path)
    assert plan.observations.format == "coco"
    assert "cam0: key points were taken, and segmentations of the file left out" in plan.observations.notes
    assert planned(session, path, masks=True).format == "coco masks"


def test_pictures_beside_other_files_are_no_masks_unless_they_are_asked_for(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    (folder / "labels.json").write_text("{}")
    with pytest.raises(FormatError, match=r"labels\.json: expected key points, joints or masks of a program"):
        planned(session, folder)
    assert planned(session, folder, masks=True).format == "masks"


def test_masks_replace_others_and_are_left_and_used_again(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names[:2], MASKS)
    first = stored(session, folder)
    assert [c.masks is not None for c in first.cameras] == [True, True, False, False]
    plan = plan_import(first, ImportRequest("other", (folder,), ("ann", "bob")))
    assert f"camera 'cam0': these masks take the place of those in {masks_folder(first, 'net') / 'cam0'}" in plan.notes
    second = store_import(first, plan)
    assert (mask_users(second, "net"), mask_users(second, "other")) == ((), ("cam0", "cam1"))
    bare = leave_masks(second)
    assert all(c.masks is None for c in load_session(session.folder).cameras)
    again, found = relink(bare, Places(masks=masks_folder(session, "net")))
    assert [(f.camera, f.old) for f in found] == [("cam0", None), ("cam1", None)]
    assert mask_users(again, "net") == ("cam0", "cam1")


def test_a_name_is_given_once(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    stored(session, folder)
    with pytest.raises(SessionError, match="exists already; choose another name"):
        store_import(session, planned(session, folder))


def test_an_import_that_cannot_be_written_leaves_nothing(session, tmp_path, monkeypatch):
    plan = planned(session, write_masks(tmp_path / "m", session.camera_names, MASKS))
    (tmp_path / "m" / "cam3" / "cam3_000003.png").write_bytes(b"changed")
    with pytest.raises(SessionError, match="has changed since it was read"):
        store_import(session, plan)
    assert not list((session.folder / "observations").iterdir())
    plan = planned(session, write_masks(tmp_path / "n", session.camera_names, MASKS))

    def fails(*_):
        raise SessionError("disk full")

    monkeypatch.setattr("tracker.interchange.observations.stored_masks.save_camera_files", fails)
    with pytest.raises(SessionError, match="disk full"):
        store_import(session, plan)
    assert not list((session.folder / "observations").iterdir())


def test_runs_of_the_helper_are_those_of_the_mask():
    assert segmentation_of(np.array([[0, 1], [1, 1]]), "runs") == {"size": [2, 2], "counts": [1, 3]}


def test_a_mask_whose_checksum_is_wrong_is_refused(session, tmp_path):
    folder = write_masks(tmp_path / "m", session.camera_names, MASKS)
    path = folder / "cam2" / "cam2_000001.png"
    data = bytearray(path.read_bytes())
    data[data.index(b"IEND") - 5] ^= 1  # the last byte of the checksum of the pixels, which can be decoded
    path.write_bytes(data)
    assert "camera 'cam2': mask: " in problems(planned(session, folder))
