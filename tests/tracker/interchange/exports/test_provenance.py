"""Provenance of exported poses, and which poses are exported."""

import json
from dataclasses import replace

import numpy as np
import pytest
from bodies import MODELS
from pycocotools.coco import COCO
from stored_motions import store_motion

from tracker.annotation import plan
from tracker.body.limbs import limbs
from tracker.errors import Remedy, SessionError
from tracker.interchange.exports import writers
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.interchange.exports.provenance import pose_arrays, pose_provenance, sources_of_points, write_provenance
from tracker.pipeline.calibration_revisions import change_calibration
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import MarkChange, PoseChange

MODEL = MODELS["gavrila38"]


def edited(session, person, frame, author, **changes):
    """Change the pose of a person in a frame."""
    with AnnotationStore(session.annotations_path) as store:
        record = replace(store.pose(person, frame), **changes)
        store.commit("Edit", [PoseChange(person, frame, record)], author=author)
        return record


@pytest.fixture
def session(tmp_path):
    """Two people; frame 2 of ann has an assessed pose, of which a person has set the left shoulder."""
    session, _ = store_motion(tmp_path / "s", [MODEL, MODELS["gavrila22"]], gaps={(0, 3)}, n_frames=6)
    names = MODEL.value_names
    sources = tuple("manual" if n.startswith("left_shoulder") else "tracked" for n in names)
    rng = np.random.default_rng(0)
    factors = rng.normal(scale=0.01, size=(len(MODEL.point_names), 3, 3))
    edited(
        session, "ann", 2, "eve", sources=sources, status="doubtful", errors=factors @ np.swapaxes(factors, 1, 2),
        limbs_lost=tuple(0.1 * (i + 1) for i in range(len(limbs(MODEL)))),
    )  # fmt: skip
    with AnnotationStore(session.annotations_path) as store:
        store.commit("Review", [MarkChange("ann", 4, keyframe=False, reviewed=True)])
    return session


def written(tmp_path, session, **options):
    path = tmp_path / "p.json"
    write_provenance(path, read_motion(session, (0, 1)), ExportOptions(**options))
    return json.loads(path.read_text())


def test_each_pose_has_its_maker_its_state_and_the_sources_of_its_joints(tmp_path, session):
    found = written(tmp_path, session)
    poses = {p["frame"]: p for p in found["people"]["ann"]}
    assert sorted(poses) == [0, 1, 2, 4, 5]
    pose = poses[2]
    assert [pose[k] for k in ("status", "source", "annotator", "keyframe")] == ["doubtful", "manual", "eve", False]
    points = found["bodies"][str(pose["body_revision"])]["points"]
    assert tuple(points) == MODEL.point_names
    assert {n for n, s in zip(points, pose["point_sources"], strict=True) if s == "manual"} == {"left_elbow"}
    lost = dict(zip(points, pose["point_lost"], strict=True))
    arm = [limb.name for limb in limbs(MODEL)].index("left_forearm")
    assert lost["left_wrist"] == pytest.approx(0.1 * (arm + 1))
    assert lost["torso"] is None
    assert [poses[f]["reviewed"] for f in (0, 1, 2, 4)] == [False, True, False, True]
    assert poses[0]["covariances_m2"] is None
    assert (found["calibration_revision"], pose["calibration_revision"], pose["earlier_calibration"]) == (1, 1, False)


@pytest.mark.parametrize("axes", ["calibration", "y-up"])
def test_covariances_turn_with_the_axes_of_the_file(tmp_path, session, axes):
    found = written(tmp_path, session, axes=axes)
    pose = next(p for p in found["people"]["ann"] if p["frame"] == 2)
    rows = np.array(pose["covariances_m2"])
    with AnnotationStore(session.annotations_path) as store:
        errors = store.pose("ann", 2).errors
    axis = {"calibration": 2, "y-up": 1}[axes]  # the world's vertical axis in the file
    diagonal = rows[:, (0, 3, 5)]
    np.testing.assert_allclose(diagonal[:, axis], errors[:, 2, 2], rtol=1e-5)
    np.testing.assert_allclose(diagonal.sum(axis=1), np.trace(errors, axis1=1, axis2=2), rtol=1e-5)


def test_poses_of_an_earlier_calibration_are_named(tmp_path, session):
    first = session.cameras[0]
    K = first.camera.K + np.array([[0, 0, 2.0], [0, 0, 0], [0, 0, 0]])
    moved = replace(session, cameras=(replace(first, camera=replace(first.camera, K=K)), *session.cameras[1:]))
    with AnnotationStore(session.annotations_path) as store:
        change_calibration(session, store, moved, "corrected")
    edited(session, "ann", 5, "eve")
    found = written(tmp_path, load_session(session.folder))
    assert found["calibration_revision"] == 2
    pairs = {p["frame"]: (p["calibration_revision"], p["earlier_calibration"]) for p in found["people"]["ann"]}
    assert (pairs[2], pairs[5]) == ((1, True), (2, False))


def test_a_point_has_the_source_of_the_nearest_joint_that_moves_it():
    model = MODELS["balls"]  # its hand does not turn
    sources = tuple("pinned" if n.startswith("elbow") else "tracked" for n in model.value_names)
    found = dict(zip(model.point_names, sources_of_points(model, sources), strict=True))
    assert found == {"root": "tracked", "shoulder": "tracked", "elbow": "tracked", "grip": "pinned", "finger": "pinned"}


def test_keyframes_or_reviewed_poses_alone_are_exported_and_the_others_still_occlude(tmp_path, session):
    everything = read_motion(session, (0, 1))
    keyframes = read_motion(session, (0, 1), only="keyframes")
    reviewed = read_motion(session, (0, 1), range(2, 6), only="reviewed")
    assert list(keyframes.frames) == [1]
    assert [list(reviewed.frames), reviewed.chosen] == [[4], (0,)]
    assert len(reviewed.bodies(4)) == len(everything.bodies(4)) == 2
    writers.write_keypoints(reviewed, ExportOptions(keypoints="coco17"), [tmp_path / "k.json"], lambda: None)
    coco = COCO(str(tmp_path / "k.json"))
    assert {(a["person"], coco.loadImgs(a["image_id"])[0]["frame"]) for a in coco.anns.values()} == {("ann", 4)}
    with pytest.raises(SessionError, match="poses of 'bob' in frames 2,3, found none that is a keyframe") as caught:
        read_motion(session, (1,), [2, 3], only="keyframes")
    assert caught.value.remedy == Remedy("export_all_poses")


def test_frames_of_a_list_are_exported_alone(session):
    motion = read_motion(session, (0, 1), [1, 3, 5])
    assert (list(motion.frames), motion.span, motion.n_missing) == ([1, 3, 5], range(1, 6), 1)
    assert sorted(motion.people[0].poses) == [1, 5]
    found = pose_provenance(motion, motion.people[0], 5)
    assert found.record.author == ""


def test_a_verified_pose_names_who_verified_it_until_it_is_edited(tmp_path, session):
    with AnnotationStore(session.annotations_path) as store:
        plan.add_tasks(store, [("ann", 2, "eve"), ("ann", 4, ""), ("ann", 5, "")])
        for frame, state in ((2, "verified"), (4, "verified"), (5, "verified"), (5, "rejected")):
            plan.decide(store, ("ann", frame), state, author="rita")
    edited(session, "ann", 4, "eve", remark="again")
    poses = {p["frame"]: p for p in written(tmp_path, session)["people"]["ann"]}
    assert {f: p["verified_by"] for f, p in poses.items()} == {0: "", 1: "", 2: "rita", 4: "", 5: ""}
    assert poses[2]["verified_time"] >= poses[2]["edit_time"]
    assert poses[4]["verified_time"] == ""
    table = pose_arrays(read_motion(session, (0, 1)), ExportOptions())
    assert table.by_pose["verified_by"][2].tolist() == ["rita", ""]
