"""Masks of parts and people in each view, read by Pillow."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS
from PIL import Image
from stored_motions import K1, store_motion

from tracker.errors import FormatError, Remedy
from tracker.evidence.contours.label_image import part_labels
from tracker.geometry import rigid
from tracker.geometry.lens_tables import lens_of, undistortion_map
from tracker.interchange.exports.label_writers import write_masks
from tracker.interchange.exports.motion import ExportOptions, PersonMotion, read_motion
from tracker.interchange.exports.views import view_labels
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import MarkChange


@pytest.fixture
def couple(tmp_path):
    """Two people; frame 2 is that of number 7 of the footage."""
    session, truth = store_motion(tmp_path / "s", [MODELS["gavrila38"], MODELS["gavrila22"]], n_frames=4)
    return replace(session, cameras=tuple(replace(c, offset=5) for c in session.cameras)), truth


def silhouette(body, camera):
    """Fill the hulls of the parts of a body, which are convex, as OpenCV projects their surfaces."""
    out = np.zeros(camera.size[::-1], np.uint8)
    pose = cv2.Rodrigues(camera.T_camera_world[:3, :3])[0], camera.T_camera_world[:3, 3], camera.K, camera.distortion
    for T, shape, center in zip(body.kinematics.Ts_world_part, body.model.shapes, body.model.centers_part, strict=True):
        surface = (shape.triangles().vertices + center) @ T[:3, :3].T + T[:3, 3]
        project = cv2.fisheye.projectPoints if camera.fisheye else cv2.projectPoints
        px = project(surface[:, None], *pose)[0].reshape(-1, 2)
        cv2.fillConvexPoly(out, cv2.convexHull(np.rint(16 * px).astype(np.int32)), 1, shift=4)
    return out > 0


def test_masks_cover_the_bodies_as_filmed_and_the_legend_names_their_labels(tmp_path, couple):
    session, truth = couple
    write_masks(read_motion(session, (0, 1), [2]), ExportOptions(), [tmp_path / "m"], lambda: None)
    legend = json.loads((tmp_path / "m" / "legend.json").read_text())
    assert legend["people"] == {
        "0": "background", "255": "a person whose pose is not exported", "1": "ann", "2": "bob"
    }  # fmt: skip
    for source in session.cameras:
        camera = source.camera
        assert camera.fisheye or camera.distortion[0] == K1
        people, parts = (Image.open(tmp_path / "m" / k / camera.name / "000007.png") for k in ("people", "parts"))
        assert people.mode == parts.mode == "P"
        label = legend["parts"]
        both = [silhouette(bodies[2], camera) for bodies in truth]
        found = np.array(people)
        assert found.shape == camera.size[::-1]
        covered, around = (both[0] | both[1]).astype(np.uint8), np.ones((3 + 2 * camera.fisheye,) * 2, np.uint8)
        assert (found[cv2.erode(covered, around) > 0] > 0).mean() > 0.999  # but for one or two pixels along the border
        assert (found[cv2.dilate(covered, around) == 0] > 0).sum() == 0
        assert set(np.unique(found)) == {0, 1, 2}
        of_parts = np.array(parts)
        owners = {int(k): v["person"] for k, v in label.items() if k not in ("0", "255")}
        assert {owners[int(i)] for i in np.unique(of_parts[found == 1])} == {"ann"}
        assert {owners[int(i)] for i in np.unique(of_parts[found == 2])} == {"bob"}
        head = next(int(k) for k, v in label.items() if v == {"person": "ann", "part": "head"})
        color = MODELS["gavrila38"].parts[1].color
        assert parts.convert("RGB").getpixel(tuple(np.argwhere(of_parts == head)[0][::-1].tolist())) == tuple(
            bytes.fromhex(color[1:])
        )


def test_undistorted_masks_are_those_of_the_camera_without_a_lens(couple):
    session, truth = couple
    for source in session.cameras:
        plain = source.camera.pinhole
        bodies = [truth[0][2], truth[1][2]]
        np.testing.assert_array_equal(view_labels(bodies, plain), part_labels(bodies, plain))


def test_a_body_at_the_border_is_covered_where_the_undistorted_picture_ends(couple):
    """With barrel distortion, the footage shows more than the undistorted picture of its size."""
    session, truth = couple
    camera = session.cameras[0].camera
    body = truth[0][2]
    columns, _ = undistortion_map(lens_of(camera))
    assert columns.min() < -20  # the left border of the footage lies outside
    # Turn the camera until the trunk lies at the left border.
    to_body = rigid.apply(camera.T_camera_world, body.joint_centers_world[0])
    wanted = (camera.rays(np.array([10.0, 240.0])) @ camera.T_world_camera[:3, :3])[[0, 2]]
    angle = np.arctan2(*wanted) - np.arctan2(to_body[0], to_body[2])
    turn = rigid.transform(rigid.so3_exp(np.array([0.0, angle, 0.0])))
    aside = replace(camera, T_world_camera=camera.T_world_camera @ rigid.inverse(turn))
    expected = silhouette(body, aside)
    assert expected.sum() > 500
    found = view_labels([body], aside) > 0
    assert part_labels([body], aside.pinhole).any(axis=0)[0]  # it goes on beyond the undistorted picture
    within = cv2.erode(expected.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert within[:, 0].any()
    assert found[within].mean() > 0.999


def test_people_who_are_not_exported_have_a_label_of_their_own(tmp_path, couple):
    session, _ = couple
    write_masks(read_motion(session, (1,), [2]), ExportOptions(), [tmp_path / "m"], lambda: None)
    for kind, own in (("people", {2}), ("parts", None)):
        found = set(np.unique(np.array(Image.open(tmp_path / "m" / kind / "cam0" / "000007.png"))).tolist())
        assert {0, 255} <= found
        assert own is None or found == own | {0, 255}


def test_a_person_without_a_selected_pose_in_a_frame_is_somebody(tmp_path, couple):
    session, _ = couple
    with AnnotationStore(session.annotations_path) as store:
        store.commit("mark", [MarkChange("bob", 2, keyframe=True, reviewed=True)])
    motion = read_motion(session, (0, 1), only="keyframes")
    assert [list(motion.frames), motion.chosen] == [[1, 2], (0, 1)]
    write_masks(motion, ExportOptions(), [tmp_path / "m"], lambda: None)
    labels = [set(np.unique(np.array(Image.open(tmp_path / "m/people/cam0" / f"00000{n}.png")))) for n in (6, 7)]
    assert labels == [{0, 1, 2}, {0, 2, 255}]


def test_more_parts_than_labels_are_refused(tmp_path, couple, monkeypatch):
    session, _ = couple
    motion = read_motion(session, (0, 1), [2])
    crowd = tuple(
        PersonMotion(i, motion.people[0].person, motion.people[0].poses, motion.people[0].around) for i in range(17)
    )
    with pytest.raises(FormatError, match="at most 254 parts of all people together") as caught:
        write_masks(replace(motion, people=crowd), ExportOptions(), [tmp_path / "m"], lambda: None)
    assert caught.value.remedy == Remedy("fewer_people")
