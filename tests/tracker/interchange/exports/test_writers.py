"""Files of an export, read by other programs."""

import csv
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS, with_center
from pycocotools.coco import COCO
from staging import cameras_around
from stored_motions import FPS, distorted_cameras, store_motion, store_poses

from tracker.errors import Remedy, SessionError
from tracker.evidence.contours.label_image import part_labels
from tracker.formats.trc import read_trc
from tracker.geometry import rigid
from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.geometry.ground_plane import GroundPlane
from tracker.interchange.exports import writers
from tracker.interchange.exports.keypoints import keypoints_in_views, project_through_lens
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion
from tracker.pipeline.calibration_revisions import change_calibration, with_corrections
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import MarkChange, PoseChange

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From a world in which z points up."""


@pytest.fixture
def off_center(tmp_path):
    """A person whose hip and wrist have joint centres beside their pivots."""
    model = with_center(MODELS["gavrila34"], "left_hip", (0.01, 0.02, -0.03))
    return store_motion(tmp_path / "s", [with_center(model, "left_wrist", (0.0, 0.02, 0.0))], n_frames=3)


def test_files_of_joints_have_the_anatomical_joint_centers(tmp_path, off_center):
    session, ((*bodies,),) = off_center[0], [off_center[1][0].values()]
    motion, options = read_motion(session, (0,), range(3)), ExportOptions("calibration", "m")
    centers = np.array([b.joint_centers_world for b in bodies])
    assert np.linalg.norm(centers - [b.points_world for b in bodies], axis=-1).max() > 0.02
    writers.write_person_trc(motion, options, [tmp_path / "a.trc"], no_tick)
    np.testing.assert_allclose(read_trc(tmp_path / "a.trc").points, centers, atol=1e-5)
    writers.write_tables(motion, options, [tmp_path / "joints.csv", tmp_path / "angles.csv"], no_tick)
    rows = [r for r in csv.DictReader(x for x in (tmp_path / "joints.csv").open() if not x.startswith("#"))]
    hip = [[float(r[f"left_hip.{axis}_m"]) for axis in "xyz"] for r in rows]
    np.testing.assert_allclose(hip, centers[:, bodies[0].model.point_names.index("left_hip")], atol=1e-5)
    cameras = [c.camera for c in session.cameras]
    for camera, (found,) in zip(cameras, keypoints_in_views(bodies[:1], cameras), strict=True):
        np.testing.assert_allclose(found.points_px, project_through_lens(camera, centers[0]))


def one(motion, index):
    return replace(motion, chosen=(index,))


def no_tick():
    pass


@pytest.fixture
def couple(tmp_path):
    """Two people; ann has gaps within and at the end, bob has a lost frame."""
    models = [MODELS["gavrila34"], MODELS["gavrila22_cones"]]
    return store_motion(tmp_path / "s", models, gaps={(0, 3), (0, 4), (0, 7), (1, 0)}, lost={(1, 5)})


def test_trc_has_the_points_of_each_frame_and_blanks_in_gaps(tmp_path, couple):
    session, truth = couple
    motion = read_motion(session, (0, 1), range(1, 8))
    ticks = []
    writers.write_person_trc(one(motion, 0), ExportOptions("y-up", "mm"), [tmp_path / "a.trc"], lambda: ticks.append(1))
    assert len(ticks) == 7
    text = (tmp_path / "a.trc").read_text().splitlines()
    assert text[2].split("\t") == ["25", "25", "7", str(len(truth[0][1].model.point_names)), "mm", "25", "2", "7"]
    assert [row.split("\t")[:2] for row in text[6:9]] == [["2", "0.040000"], ["3", "0.080000"], ["4", "0.120000"]]
    table = read_trc(tmp_path / "a.trc")
    assert table.names == truth[0][1].model.point_names
    for row, frame in enumerate(range(1, 8)):
        if frame in (3, 4, 7):
            assert np.isnan(table.points[row]).all()
        else:
            expected = rigid.apply(Y_UP, truth[0][frame].points_world)
            np.testing.assert_allclose(table.points[row], expected, atol=1e-6)


def test_tables_have_a_row_for_each_person_and_frame(tmp_path, couple):
    session, truth = couple
    paths = [tmp_path / "m.csv", tmp_path / "m_angles.csv"]
    writers.write_tables(read_motion(session, (0, 1)), ExportOptions(units="mm"), paths, no_tick)
    joints, angles = (list(csv.DictReader(path.open())) for path in paths)
    assert [(r["person"], int(r["frame"])) for r in joints] == [(p, f) for p in ("ann", "bob") for f in range(8)]
    assert [(r["person"], r["frame"]) for r in angles] == [(r["person"], r["frame"]) for r in joints]
    for i, first in ((0, 0), (1, 8)):
        body = truth[i][1]
        row, of = joints[first + 1], angles[first + 1]
        assert [row[c] for c in ("status", "source", "keyframe", "cost_px")] == ["good", "manual", "true", "2.5000000"]
        assert [row[f"cost_{c.camera.name}_px"] for c in session.cameras] == ["1.0000000", "", "3.0000000"]
        assert float(row["time_s"]) == 1 / FPS
        for name, place in zip(body.model.point_names, body.points_world, strict=True):
            found = [float(row[f"{name}.{axis}_mm"]) for axis in "xyz"]
            np.testing.assert_allclose(found, 1000 * place, atol=1e-4)
        assert float(of["torso.x_mm"]) == pytest.approx(1000 * body.values[0], abs=1e-4)
        assert float(of["left_elbow.extension_deg"]) == pytest.approx(
            np.degrees(body.values[body.model.value_names.index("left_elbow.extension")]), abs=1e-5
        )
    gap = joints[3]
    assert gap["status"] == gap["source"] == gap["keyframe"] == gap["cost_px"] == gap["torso.x_mm"] == ""
    assert joints[8 + 5]["status"] == "lost"
    assert joints[8 + 5]["torso.x_mm"] != ""
    assert angles[8 + 1]["spine.abduction_deg"] == ""  # bob's trunk is rigid


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize(("axes", "units", "up"), [("y-up", "mm", "z"), ("calibration", "m", "-y")])
def test_bvh_puts_the_joints_where_they_are(tmp_path, name, axes, units, up):
    session, truth = store_motion(tmp_path / "s", [MODELS[name]], gaps={(0, 2), (0, 7)}, up=up, seed=3)
    motion = read_motion(session, (0,), range(8))
    options = ExportOptions(axes, units)
    writers.write_person_bvh(motion, options, [tmp_path / "a.bvh"], no_tick)
    bvhio = pytest.importorskip("bvhio", reason="a library below it has no wheel for Python 3.14")
    file = bvhio.readAsBvh(str(tmp_path / "a.bvh"))
    assert file.FrameCount == 8
    assert pytest.approx(1 / FPS) == file.FrameTime
    root = bvhio.readAsHierarchy(str(tmp_path / "a.bvh"))
    T = file_from_world(session, axes)
    for frame in truth[0]:
        root.loadPose(frame)
        expected = truth[0][frame].named_points_world
        seen = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root.layout()}
        assert {j.name for j in truth[0][frame].model.joints} <= seen.keys()
        for joint, place in seen.items():
            wanted = options.per_metre * rigid.apply(T, expected[joint])
            np.testing.assert_allclose(place, wanted, atol=1e-4 * options.per_metre, err_msg=joint)
    angles = np.array(
        [k.Rotation.to_list() if hasattr(k.Rotation, "to_list") else list(k.Rotation) for k in file.Root.Keyframes]
    )
    assert np.isfinite(angles).all()


def test_bvh_fills_gaps_and_stands_still_at_the_ends(tmp_path, couple):
    session, truth = couple
    poses = read_motion(session, (0,), range(8)).exported[0].without_gaps(range(8))
    np.testing.assert_array_equal(poses[7], truth[0][6].values)
    elbow = truth[0][2].model.value_names.index("left_elbow.extension")
    steps = np.diff(poses[2:6, elbow])  # frames 3 and 4 are missing
    np.testing.assert_allclose(steps, steps[0], atol=1e-9)


def test_keypoints_are_where_the_footage_shows_them(tmp_path, couple):
    session, truth = couple
    motion = read_motion(session, (0, 1), range(2, 7))
    writers.write_keypoints(motion, ExportOptions(), [tmp_path / "k.json"], no_tick)
    coco = COCO(str(tmp_path / "k.json"))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["person", "gavrila34", "gavrila22_cones"]
    assert len(coco.getImgIds()) == 5 * 3
    off_axis_px = 0.0
    for image in coco.loadImgs(coco.getImgIds()):
        camera = next(c.camera for c in session.cameras if c.camera.name == image["camera"])
        assert image["file_name"] == f"{camera.name}/{image['frame']:06d}.jpg"
        here = [i for i in (0, 1) if image["frame"] in truth[i]]
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))
        assert sorted((a["track_id"], a["category_id"]) for a in annotations) == sorted(
            (i, c) for i in here for c in (1, 2 + i)
        )
        for row in annotations:
            body = truth[row["track_id"]][image["frame"]]
            names = coco.loadCats(row["category_id"])[0]["keypoints"]
            triples = np.array(row["keypoints"]).reshape(-1, 3)
            assert row["num_keypoints"] == np.count_nonzero(triples[:, 2])
            T = camera.T_camera_world
            pose = cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], camera.K, camera.distortion
            if camera.fisheye:
                filmed_px = cv2.fisheye.projectPoints(body.points_world[:, None], *pose)[0].reshape(-1, 1, 2)
            else:
                filmed_px, _ = cv2.projectPoints(body.points_world, *pose)
            pinhole_px, _ = cv2.projectPoints(
                body.points_world, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], camera.K, np.zeros(4)
            )
            for name, (x, y, v) in zip(names, triples, strict=True):
                if v:
                    at = body.model.point_names.index(name)
                    np.testing.assert_allclose((x, y), filmed_px[at, 0], atol=0.1)
                    off_axis_px = max(off_axis_px, np.abs(filmed_px[at] - pinhole_px[at]).max())
                else:
                    assert (x, y) == (0, 0)
            if row["category_id"] == 1:
                assert len(names) == 17
                assert triples[:5, 2].tolist() == [0] * 5  # the body has no eyes, ears and nose
            x, y, w, h = row["bbox"]
            inside = triples[triples[:, 2] > 0, :2]
            assert (inside >= (x - 1, y - 1)).all()
            assert (inside <= (x + w + 1, y + h + 1)).all()
            assert 0.1 * w * h < row["area"] < w * h
    assert off_axis_px > 3  # else the test could not tell filmed from undistorted pixels
    flags = {v for a in coco.loadAnns(coco.getAnnIds()) for v in a["keypoints"][2::3]}
    assert {1, 2} <= flags


def test_keypoints_beyond_the_lens_are_absent(tmp_path):
    """Far outside the image the polynomial of a lens with k1 < 0 folds back into it."""
    camera = distorted_cameras()[0]
    inside, outside = (camera.T_world_camera @ [x, 0.1, 1.0, 1.0] for x in (0.2, 1.7))
    px = project_through_lens(camera, np.array([inside[:3], outside[:3]]))
    assert np.isfinite(px[0]).all()
    assert np.isnan(px[1]).all()
    folded = camera.project(outside[:3])
    assert 0 <= folded[0] < 640


def test_the_area_is_that_of_the_silhouette(couple):
    _, truth = couple
    camera = cameras_around(3, size=(640, 480))[0]  # the label image has no distortion
    for body in (truth[0][1], truth[1][1]):
        ((seen,),) = keypoints_in_views([body], [camera])
        rows, columns = np.nonzero(part_labels([body], camera))
        assert seen.area_px == pytest.approx(len(rows), rel=0.04)
        box = [columns.min(), rows.min(), np.ptp(columns), np.ptp(rows)]
        np.testing.assert_allclose(seen.box_px, box, atol=3)


def test_files_name_the_calibration_and_the_poses_of_an_earlier_one(tmp_path):
    """The pose of frame 2 was made again after a camera was corrected, that of frame 1 before."""
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila22"]], n_frames=3)
    with AnnotationStore(session.annotations_path) as store:
        pose = store.pose("ann", 2)
        corrections = np.zeros((3, N_CORRECTIONS))
        corrections[0, 0] = 0.01
        session = change_calibration(session, store, with_corrections(session, corrections), "corrected")
        store.commit("again", [PoseChange("ann", 2, pose)])
    motion = read_motion(session, (0,), range(1, 3))
    paths = [tmp_path / name for name in ("m.csv", "m_angles.csv", "m.mot", "m.osim", "m.json")]
    writers.write_tables(motion, ExportOptions(), paths[:2], no_tick)
    for path in paths[:2]:
        rows = list(csv.DictReader(path.open()))
        assert [(r["calibration"], r["earlier_calibration"]) for r in rows] == [("1", "true"), ("2", "false")]
    note = "calibration revision 2 of the session; 1 of 2 poses are of an earlier one"
    writers.write_person_opensim(motion, ExportOptions(), paths[2:4], no_tick)
    assert note in paths[2].read_text().partition("endheader")[0].splitlines()
    writers.write_keypoints(motion, ExportOptions(), paths[4:], no_tick)
    report = json.loads(paths[4].read_text())
    assert report["info"]["calibration"] == 2
    assert note in report["info"]["description"]
    frames = {image["id"]: image["frame"] for image in report["images"]}
    told = {(frames[a["image_id"]], a["calibration"], a["earlier_calibration"]) for a in report["annotations"]}
    assert told == {(1, 1, True), (2, 2, False)}


def test_without_a_correction_the_calibration_is_the_first(tmp_path, couple):
    session, _ = couple
    motion = read_motion(session, (0, 1), range(1, 3))
    assert motion.calibration_note == "calibration revision 1 of the session"
    writers.write_tables(motion, ExportOptions(), [tmp_path / "m.csv", tmp_path / "m_angles.csv"], no_tick)
    rows = list(csv.DictReader((tmp_path / "m.csv").open()))
    assert {(r["calibration"], r["earlier_calibration"]) for r in rows} == {("1", "false")}


@pytest.mark.parametrize(("keypoints", "names"), [("coco17", ["person"]), ("body", ["gavrila34"])])
def test_one_set_of_keypoints_of_one_person_whom_others_occlude(tmp_path, couple, keypoints, names):
    session, truth = couple
    motion = read_motion(session, (0,), range(1, 3))
    writers.write_keypoints(motion, ExportOptions(keypoints=keypoints), [tmp_path / "k.json"], no_tick)
    coco = COCO(str(tmp_path / "k.json"))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == names
    annotations = coco.loadAnns(coco.getAnnIds())
    assert {a["person"] for a in annotations} == {"ann"}
    cameras = [c.camera for c in session.cameras]
    alone = [view[0] for f in (1, 2) for view in keypoints_in_views([truth[0][f]], cameras)]
    n_visible = sum(v == 2 for a in annotations for v in a["keypoints"][2::3])
    points = coco.loadCats(coco.getCatIds())[0]["keypoints"]
    at = [truth[0][1].model.point_names.index(p) for p in points if p in truth[0][1].model.point_names]
    assert 0 < n_visible < sum(np.count_nonzero(seen.visibility[at] == 2) for seen in alone)


def test_images_are_named_as_the_footage_numbers_them(tmp_path, couple):
    session, _ = couple
    folder = tmp_path / "shots"
    folder.mkdir()
    for i in (1, 2, 9, 10):
        cv2.imwrite(str(folder / f"shot{i}.png"), np.zeros((480, 640, 3), np.uint8))
    cameras = (replace(session.cameras[0], footage=folder, offset=1), replace(session.cameras[1], offset=5))
    motion = replace(read_motion(session, (0, 1), range(1, 3)), session=replace(session, cameras=cameras))
    writers.write_keypoints(motion, ExportOptions(), [tmp_path / "k.json"], no_tick)
    images = COCO(str(tmp_path / "k.json")).dataset["images"]
    names = [i["file_name"] for i in images if i["frame"] == 2]
    assert names == ["cam0/shot10.png", "cam1/000007.jpg"]
    assert [i["video_frame"] for i in images if i["frame"] == 2] == [3, 7]


def test_y_is_the_height_above_a_floor_that_was_set():
    normal = np.array([0.1, 0.0, 1.0]) / np.linalg.norm([0.1, 0.0, 1.0])

    class Tilted:
        up, floor = "z", GroundPlane(normal, 0.4)

    point = np.array([0.3, -0.8, 1.9])
    T = file_from_world(Tilted, "y-up")
    assert rigid.apply(T, point)[1] == pytest.approx(normal @ point - 0.4)
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    np.testing.assert_array_equal(file_from_world(Tilted, "calibration"), np.eye(4))


def test_lost_poses_are_left_out_on_request_and_nobody_is_refused(couple):
    session, _ = couple
    kept, left = (read_motion(session, (0, 1), skip_lost=s) for s in (False, True))
    assert (5 in kept.people[1].poses, 5 in left.people[1].poses) == (True, False)
    assert (kept.n_lost, left.n_lost) == (1, 1)
    assert left.n_missing == kept.n_missing + 1
    with pytest.raises(SessionError, match="expected poses of 'bob' in frames 0:1, found none"):
        read_motion(session, (1,), range(1))
    assert read_motion(session, (0, 1), range(1)).chosen == (0,)


def test_a_keyframe_is_never_left_out_as_lost(couple):
    session, _ = couple
    with AnnotationStore(session.annotations_path) as store:
        store.commit("mark", [MarkChange("bob", 5, keyframe=True, reviewed=True)])
    motion = read_motion(session, (0, 1), skip_lost=True)
    assert (5 in motion.people[1].poses, motion.n_lost) == (True, 0)


def test_poses_of_another_body_are_tabled_but_give_no_skeleton(tmp_path):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila34"]], n_frames=2)
    other = MODELS["gavrila22"]
    values = other.neutral()
    store_poses(session, {1: values}, replace(session.people[0], model=other))
    motion = read_motion(session, (0,))
    writers.write_person_trc(motion, ExportOptions(), [tmp_path / "a.trc"], no_tick)
    table = read_trc(tmp_path / "a.trc")
    found = {name: table.points[:, i] for i, name in enumerate(table.names)}
    places = other.named_points_world(values)
    np.testing.assert_allclose(found["left_wrist"][1], places["left_wrist"], atol=1e-6)
    assert np.isnan(found["waist"][:, 0]).tolist() == [False, True]
    writers.write_keypoints(motion, ExportOptions(), [tmp_path / "k.json"], no_tick)
    assert {c["name"] for c in COCO(str(tmp_path / "k.json")).dataset["categories"]} > {"gavrila34", "gavrila22"}
    with pytest.raises(SessionError, match="of 'gavrila34', found some of 'gavrila22'") as caught:
        writers.write_person_bvh(motion, ExportOptions(), [tmp_path / "a.bvh"], no_tick)
    assert caught.value.remedy == Remedy("frames_of_one_body")


def test_poses_of_earlier_sizes_are_refitted_for_a_skeleton(tmp_path):
    session, truth = store_motion(tmp_path / "s", [MODELS["gavrila22"]], n_frames=3)
    taller = session.people[0].model.with_height(1.9)
    values = truth[0][2].values
    store_poses(session, {2: values}, replace(session.people[0], model=taller))
    person = read_motion(load_session(session.folder), (0,)).exported[0]
    assert person.n_refitted == 1
    assert person.model is not person.poses[2].body.model
    refitted = person.in_one_body()[2]
    before = taller.points_world(values)
    assert np.linalg.norm(person.model.points_world(refitted) - before, axis=1).max() < 0.1
    assert np.abs(refitted - values).max() > 1e-3
