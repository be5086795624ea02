import json
import re
import shutil

import numpy as np
import pytest
from damaged_arrays import encrypted
from joint_files import write_joints
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.errors import FormatError, SessionError
from tracker.formats.joint_maps import read_joint_map
from tracker.formats.motion_csv import MotionRow, write_motion_csv
from tracker.formats.trc import write_trc
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.observed import observed_joints, triangulate_observations
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import list_observations, load_observations, source_path
from tracker.interchange.plausibility.examine import plan_examined_import
from tracker.session.session import load_session

N = 12
TRUTH = walking(N)


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


@pytest.fixture
def keypoints(session, tmp_path):
    return write_openpose(tmp_path / "keypoints", session.camera_names, seen(session, [TRUTH]))


def planned(session, path, **choices):
    request = ImportRequest("mp", (path,), tuple(p.name for p in session.people), **choices)
    return plan_import(session, request)


def problems(plan):
    return " | ".join(map(str, plan.problems))


def accepted(session, path, **choices):
    """Plan an import that has no problems."""
    plan = planned(session, path, **choices)
    assert not plan.problems, problems(plan)
    return plan


def in_space(session, observations):
    return observed_joints(observations, [c.camera for c in session.cameras]).joints_world


def test_key_points_are_stored_and_triangulated(session, keypoints):
    plan = accepted(session, keypoints)
    store_import(session, plan)
    assert list_observations(session) == ["mp"]
    observations = load_observations(load_session(session.folder), "mp")
    assert observations.points.cameras == session.camera_names
    assert observations.point_names == BODY_25.points
    assert observations.counterparts["MidHip"] == ("left_hip", "right_hip")
    assert observations.counterparts["Nose"] == ()
    assert np.abs(in_space(session, observations)[:, 0] - TRUTH).max() < 1e-4  # files have three decimals
    for source in observations.sources:
        assert source_path(session, "mp", source).read_bytes() == (keypoints / source.path).read_bytes()
    assert len(observations.sources) == 4 * N
    assert [f for f in session.folder.joinpath("observations").iterdir() if f.name.startswith(".")] == []


def test_several_people_are_told_apart(tmp_path):
    session = make_session(tmp_path / "s", N, people=("ann", "ben"))
    motions = [walking(N, (-0.6, -0.5, 0)), walking(N, (0.5, 0.6, 0), (-0.03, -0.01, 0))]
    points = seen(session, motions)
    points[4:, 1] = points[4:, 1, ::-1]
    points[6, 2, 0] = (np.nan, np.nan, 0)
    plan = accepted(session, write_openpose(tmp_path / "k", session.camera_names, points))
    found = in_space(session, plan.observations)
    order = [0, 1] if np.abs(found[0, 0] - motions[0][0]).max() < 0.01 else [1, 0]
    assert np.abs(found[:, order] - np.stack(motions, axis=1)).max() < 1e-3


def test_exchanged_sides_are_reported_and_mended(session, tmp_path):
    points = seen(session, [TRUTH])
    for left, right in (("LHip", "RHip"), ("LKnee", "RKnee"), ("LAnkle", "RAnkle")):
        pair = [BODY_25.points.index(left), BODY_25.points.index(right)]
        points[5, 2][:, pair] = points[5, 2][:, pair[::-1]]
    observations = planned(session, write_openpose(tmp_path / "k", session.camera_names, points)).observations
    triangulation = triangulate_observations(observations, [c.camera for c in session.cameras])
    assert np.argwhere(triangulation.is_exchanged).tolist() == [[5, 0, 2, 1]]
    knee = BODY_25.points.index("LKnee")
    assert np.abs(triangulation.joints.joints_world[:, 0, knee] - TRUTH[:, knee]).max() < 1e-3


@pytest.mark.parametrize("layout", ["flat", "suffix", "nested"])
def test_cameras_are_found_by_the_names_of_folders_and_files(session, keypoints, tmp_path, layout):
    other = tmp_path / "other"
    for name in session.camera_names:
        if layout == "flat":
            shutil.copytree(keypoints / name, other, dirs_exist_ok=True)
        elif layout == "suffix":
            shutil.copytree(keypoints / name, other / f"{name}_json")
            for file in (other / f"{name}_json").iterdir():
                file.rename(file.with_name(file.name.removeprefix(f"{name}_")))
        else:
            shutil.copytree(keypoints / name, other / "pose" / name)
    plan = accepted(session, other)
    assert np.abs(in_space(session, plan.observations)[:, 0] - TRUTH).max() < 1e-4


def test_a_folder_of_no_camera_is_shown_and_can_be_named(session, keypoints):
    (keypoints / "cam0").rename(keypoints / "left")
    for file in (keypoints / "left").iterdir():
        file.rename(file.with_name(file.name.replace("cam0", "left")))
    plan = planned(session, keypoints)
    assert "expected the name of a camera (cam0, cam1, cam2, cam3)" in problems(plan)
    assert plan.views[0].place is None
    assert not planned(session, keypoints, cameras={"cam0": keypoints / "left"}).problems


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (lambda k: k[:-3], "the 12 pictures of the footage, numbers 0 to 11, found numbers 0 to 8 [(]9 pictures[)]"),
        (lambda k: np.concatenate([k, k[:2]]), "found numbers 0 to 13"),
        (lambda k: k * [1 / 640, 1 / 480, 1], "found coordinates up to .* which are normalized"),
        (lambda k: k * [2, 2, 1], "key points of the 640x480 footage, found .*% of the points outside"),
        (lambda k: k * [0.5, 0.5, 1], "pass each other by over .* as key points of 320x240 pictures they would by 0"),
        (lambda k: k[:, [1, 0, 2, 3]], "pass each other by over .* with cam0 and cam1 exchanged by 0 cm"),
        (lambda k: k * [1, 1, 0], "expected a confidence for each point, found none"),
        (lambda k: k[:, :, :, :23], "number of points of a known skeleton.*found 23"),
    ],
)
def test_files_that_contradict_the_session_are_previewed_and_refused(session, tmp_path, wrong, expected):
    points = wrong(seen(session, [TRUTH]))
    plan = planned(session, write_openpose(tmp_path / "k", session.camera_names, points))
    assert plan.views[0].n_rows == len(points)
    assert re.search(expected, problems(plan)), problems(plan)
    with pytest.raises(FormatError):
        store_import(session, plan)
    assert list_observations(session) == []


def test_choices_accept_what_would_be_refused(session, tmp_path):
    points = seen(session, [TRUTH])
    halves = write_openpose(tmp_path / "half", session.camera_names, points[3:9] * [0.5, 0.5, 0])
    plan = accepted(session, halves, first_frame=3, confidence=1.0, picture_size=(320, 240))
    found = plan.observations.points
    assert np.flatnonzero(found.is_known.any(axis=(1, 2, 3))).tolist() == [*range(3, 9)]
    assert found.confidence.max() == 1.0
    # Halves of pixel borders, not of centres, stay aligned.
    assert np.nanmax(np.abs(found.points_px[3:9] - (points[3:9, ..., :2] + 0.5))) < 0.01


def test_missing_pictures_are_named_and_nothing_shifts(session, keypoints):
    (keypoints / "cam1" / "cam1_000000000004_keypoints.json").unlink()
    plan = accepted(session, keypoints)
    assert "camera 'cam1': no picture for frames 4; the points are absent there" in plan.observations.notes
    known = plan.observations.points.is_known.any(axis=(2, 3))
    assert np.argwhere(~known).tolist() == [[4, 1]]
    assert np.abs(in_space(session, plan.observations)[:, 0] - TRUTH).max() < 1e-4


def test_numbers_count_the_footage_from_0_or_1_and_offsets_are_taken_off(tmp_path):
    session = make_session(tmp_path / "s", N, offsets=[("cam1", 2)])
    for first in (0, 1):
        folder = tmp_path / f"k{first}"
        points = seen(session, [TRUTH])
        write_openpose(folder, ["cam0", "cam2", "cam3"], points[:, [0, 2, 3]], first)
        early = np.concatenate([points[:2, 1:2] * 0, points[:, 1:2]])
        write_openpose(folder, ["cam1"], early, first)
        plan = accepted(session, folder)
        assert np.abs(in_space(session, plan.observations)[:, 0] - TRUTH).max() < 1e-4
        assert any("count pictures from 1" in n for n in plan.observations.notes) == bool(first)


def test_a_skeleton_without_names_can_be_listed_by_hand(session, tmp_path):
    points = seen(session, [TRUTH])[..., :3, :]
    (tmp_path / "map.toml").write_text(
        'points = ["a", "b", "c"]\nleft_wrist = "b"\n[means]\nc = ["left_hip", "right_hip"]'
    )
    folder = write_openpose(tmp_path / "k", session.camera_names, points)
    plan = accepted(session, folder, joint_map=tmp_path / "map.toml")
    assert plan.observations.counterparts == {"a": (), "b": ("left_wrist",), "c": ("left_hip", "right_hip")}
    (tmp_path / "map.toml").write_text('points = ["a", "b"]\nleft_wrist = "b"\n')
    assert "the 2 points that the joint map map.toml lists, found 3" in problems(
        planned(session, folder, joint_map=tmp_path / "map.toml")
    )


def test_points_in_space(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, TRUTH, 30.0)
    plan = accepted(session, tmp_path / "a.trc")
    store_import(session, plan)
    observations = load_observations(session, "mp")
    assert observations.points is None
    assert np.abs(observations.joints.joints_world[:, 0] - TRUTH).max() < 1e-6
    assert observations.row_frames[0].tolist() == [*range(N)]


@pytest.mark.parametrize(
    ("points", "rate", "expected"),
    [
        (np.concatenate([TRUTH, TRUTH]), 30.0, "rows of frames 0 to 11, found frames 0 to 23"),
        (TRUTH + np.array([9.0, 0.0, 0.0]), 30.0, "points that two cameras show, found 0%"),
        (TRUTH * 1000, 30.0, "times 0.001 the points fit one of 1.71 m"),
    ],
)
def test_points_in_space_that_contradict_the_session(session, tmp_path, points, rate, expected):
    write_trc(tmp_path / "a.trc", BODY_25.points, points, rate)
    request = ImportRequest("mp", (tmp_path / "a.trc",), tuple(p.name for p in session.people))
    assert expected in problems(plan_examined_import(session, request))


def test_rows_that_are_missing_are_named(session, tmp_path):
    kept = [0, 1, 5, 6, 7]
    write_trc(tmp_path / "a.trc", BODY_25.points, TRUTH[kept], 30.0, frames=kept)
    plan = planned(session, tmp_path / "a.trc")
    assert "a.trc: no rows for frames 2 to 4, 8 to 11; the points are absent there" in plan.observations.notes
    known = np.isfinite(plan.observations.joints.joints_world).all(axis=(1, 2, 3))
    assert np.flatnonzero(known).tolist() == kept


def test_rows_beyond_the_session_are_left_out_if_the_user_places_them(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, np.concatenate([TRUTH, TRUTH]), 30.0)
    plan = accepted(session, tmp_path / "a.trc", first_frame=0)
    assert "a.trc: 12 rows lie outside of the session and were left out" in plan.observations.notes


def test_another_rate_is_resampled_and_named(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, np.repeat(TRUTH, 4, axis=0)[:45], 120.0)
    plan = accepted(session, tmp_path / "a.trc")
    assert any("resampled from 120 to 30" in n for n in plan.observations.notes)
    assert np.allclose(plan.observations.row_frames, np.arange(45) / 4)


def test_one_file_for_each_person(tmp_path):
    session = make_session(tmp_path / "s", N, people=("ann", "ben"))
    write_trc(tmp_path / "a.trc", BODY_25.points, TRUTH, 30.0)
    with pytest.raises(SessionError, match=r"one file of points in space for each person \(ann, ben\), found 1"):
        planned(session, tmp_path / "a.trc")
    write_trc(tmp_path / "b.trc", BODY_25.points, TRUTH + 0.1, 30.0)
    request = ImportRequest("two", (tmp_path / "a.trc", tmp_path / "b.trc"), ("ben", "ann"))
    found = plan_import(session, request).observations
    assert np.abs(found.joints.joints_world[:, 0] - TRUTH).max() < 1e-6
    assert found.joints.people == ("ben", "ann")


@pytest.mark.parametrize(("kind", "names"), [("people", ("ann", "ben")), ("c3d", ("Ann", "Ben"))])
def test_people_of_one_file_are_known_by_name(tmp_path, kind, names):
    session = make_session(tmp_path / "s", N, people=("BEN", "ann"))
    path = write_joints(kind, tmp_path, BODY_25.points, np.stack([TRUTH, TRUTH + 0.2]))
    plan = accepted(session, path)
    ben, ann = np.moveaxis(plan.observations.joints.joints_world, 1, 0)
    assert np.abs(ann - TRUTH).max() < 1e-5
    assert np.abs(ben - TRUTH - 0.2).max() < 1e-5
    alone = plan_import(session, ImportRequest("one", (path,), ("BEN",)))
    assert np.abs(alone.observations.joints.joints_world[:, 0] - TRUTH - 0.2).max() < 1e-5
    assert alone.observations.notes == (f"the points of {names[0]} are left out",)


def test_people_of_one_file_in_order(tmp_path):
    path = write_joints("people", tmp_path, BODY_25.points, np.stack([TRUTH, TRUTH + 0.2]))
    plan = planned(make_session(tmp_path / "s", N, people=("one", "two")), path)
    assert np.abs(plan.observations.joints.joints_world[:, 1] - TRUTH - 0.2).max() < 1e-5
    assert plan.observations.notes == ("a.csv: ann is taken for one", "a.csv: ben is taken for two")
    with pytest.raises(
        SessionError, match=r"\(person\), found 2 people \(ann, ben\) in a.csv; make a session of as many"
    ):
        planned(make_session(tmp_path / "t", N, people=("person",)), path)


def test_a_person_whom_the_file_names_is_nobody_else(tmp_path):
    path = write_joints("people", tmp_path, BODY_25.points, np.stack([TRUTH, TRUTH + 0.2]))
    plan = planned(make_session(tmp_path / "s", N, people=("ben", "carl")), path)
    ben, carl = np.moveaxis(plan.observations.joints.joints_world, 1, 0)
    assert np.abs(ben - TRUTH - 0.2).max() < 1e-5
    assert np.abs(carl - TRUTH).max() < 1e-5
    assert plan.observations.notes == ("a.csv: ann is taken for carl",)


def test_our_own_tables_of_motion_are_read_back(tmp_path):
    session = make_session(tmp_path / "s", N, people=("ann", "ben"))
    columns = [f"{name}.{what}_mm" for name in BODY_25.points for what in ("x", "y", "z", "error")]
    rows = []
    for person, points in zip(("ann", "ben"), (TRUTH, TRUTH + 0.2), strict=True):
        for k, row in enumerate(points):
            values = [x for x, y, z in row * 1000 for x in (x, y, z, 4.0)]
            rows.append(MotionRow(person, k, k / 30, values=values if (person, k) != ("ben", 3) else ()))
    write_motion_csv(tmp_path / "motion.csv", session.camera_names, columns, rows)
    store_import(session, planned(session, tmp_path / "motion.csv"))
    ann, ben = np.moveaxis(load_observations(session, "mp").joints.joints_world, 1, 0)
    assert np.abs(ann - TRUTH).max() < 1e-6
    assert np.isnan(ben[3]).all()
    assert np.nanmax(np.abs(ben - TRUTH - 0.2)) < 1e-6


@pytest.mark.parametrize("kind", ["npy", "easymocap"])
def test_joints_without_names_are_known_by_their_number(session, tmp_path, kind):
    plan = accepted(session, write_joints(kind, tmp_path, BODY_25.points, TRUTH[None]), unit_m=1.0)
    assert plan.observations.joint_map.name == "BODY_25"
    assert plan.observations.point_names == BODY_25.points
    other = planned(session, write_joints(kind, tmp_path / "b", range(23), TRUTH[None, :, :23]), unit_m=1.0)
    assert "the number of points of a known skeleton" in problems(other)


def test_numbered_points_that_appear_late_or_never(session, tmp_path):
    points = TRUTH.copy()
    points[:2, 0] = np.nan
    points[:, 20] = np.nan
    plan = accepted(session, write_joints("caliscope", tmp_path, BODY_25.points, points[None]), unit_m=1.0)
    assert plan.observations.point_names == BODY_25.points
    assert np.nanmax(np.abs(plan.observations.joints.joints_world[:, 0] - points)) < 1e-5


@pytest.mark.parametrize("kind", ["caliscope", "npy"])
def test_hands_after_a_body_without_names(session, tmp_path, kind):
    body = read_joint_map("BlazePose_33")
    points = np.full((N, 543 if kind == "npy" else 121, 3), np.nan)
    points[:, [*range(33), *range(100, 121)]] = np.arange(54 * 3).reshape(54, 3) / 100
    for joint, marker in body.markers.items():
        if joint in BODY_25.markers:
            points[:, body.points.index(marker)] = TRUTH[:, BODY_25.points.index(BODY_25.markers[joint])]
    plan = accepted(session, write_joints(kind, tmp_path, range(points.shape[1]), points[None]), unit_m=1.0)
    assert plan.observations.point_names[:33] == body.points
    assert "120" in plan.observations.point_names
    wrist = plan.observations.point_names.index("left_wrist")
    assert np.nanmax(np.abs(plan.observations.joints.joints_world[:, 0, wrist] - points[:, 15])) < 1e-5


def test_numbers_of_no_skeleton_in_a_table_of_caliscope(session, tmp_path):
    path = write_joints("caliscope", tmp_path, range(14), TRUTH[None, :, :14]).rename(tmp_path / "xyz_HOLISTIC.csv")
    plan = planned(session, path.rename(tmp_path / "joints.csv"), unit_m=1.0)
    assert "found 14" in problems(plan)
    assert any("the table of Caliscope whose name ends in _labelled.csv" in n for n in plan.observations.notes)


def test_files_of_other_programs_are_named(session, tmp_path):
    (tmp_path / "joints.json").write_text(json.dumps(TRUTH.tolist()))
    with pytest.raises(FormatError, match=r"is of a plain array in JSON, which is not read; export .* numpy\.save"):
        planned(session, tmp_path / "joints.json")
    (tmp_path / "walk.fbx").write_bytes(b"Kaydara FBX Binary")
    with pytest.raises(FormatError, match=r"is of FBX, which is not read; export BVH"):
        planned(session, tmp_path / "walk.fbx")


def test_views_with_different_points(session, tmp_path):
    points = seen(session, [TRUTH])
    write_openpose(tmp_path / "k", session.camera_names[:3], points[:, :3])
    write_openpose(tmp_path / "k", session.camera_names[3:], points[:, 3:, :, :17])
    with pytest.raises(FormatError, match=r"the same points in all views, found 25 .* and 17"):
        planned(session, tmp_path / "k")


def test_a_file_that_changes_between_preview_and_import(session, keypoints):
    plan = planned(session, keypoints)
    (keypoints / "cam0" / "cam0_000000000000_keypoints.json").write_text(json.dumps({"people": []}))
    with pytest.raises(SessionError, match="has changed since it was read"):
        store_import(session, plan)
    assert list_observations(session) == []


def test_a_name_is_taken_once(session, keypoints):
    store_import(session, planned(session, keypoints))
    with pytest.raises(SessionError, match="exists already; choose another name"):
        store_import(session, planned(session, keypoints))


def test_unknown_and_damaged_observations(session, keypoints):
    with pytest.raises(SessionError, match="found 'x'; the session has none"):
        load_observations(session, "x")
    store_import(session, planned(session, keypoints))
    path = session.folder / "observations" / "mp" / "points.npz"
    data = path.read_bytes()
    for damaged in (data[: len(data) // 2], encrypted(data)):
        path.write_bytes(damaged)
        with pytest.raises(SessionError, match=r"cannot be read.*import the files again"):
            load_observations(session, "mp")
    path.unlink()
    with pytest.raises(SessionError, match="import the files again"):
        load_observations(session, "mp")
