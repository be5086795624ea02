"""Key points of detectors and of programs for labels: each is known by content, and read as it was written."""

import json
import tracemalloc

import numpy as np
import pytest
from mask_files import SIZE, image_of, person_masks
from observed_people import BODY_25, make_session, seen, walking, write_openpose
from program_files import BY_HAND, FORMATS, WRITERS, write_cvat_points, write_eks, write_hand_labels, write_sleap_csv
from program_tables import observation_table

from tracker.errors import FormatError
from tracker.formats.keypoints.coco_reading import read_coco
from tracker.formats.keypoints.detections import read_yolo
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.observed import observed_joints
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.readers import FORMATS as FORMATS_BY_NAME
from tracker.interchange.observations.readers import PICTURE_FORMATS, UNREAD, find_files
from tracker.interchange.observations.sources import match_cameras, numbered_groups

N = 8
TRUTH = walking(N)
POINTS = BODY_25.points


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


def planned(session, path, **choices):
    return plan_import(session, ImportRequest("mp", (path,), ("ann",), **choices))


def imported(session, path, **choices):
    plan = planned(session, path, **choices)
    assert not plan.problems, plan.problems
    return plan.observations


def in_space(session, observations):
    return observed_joints(observations, [c.camera for c in session.cameras]).joints_world[:, 0]


@pytest.mark.parametrize("program", WRITERS)
def test_programs(session, tmp_path, program):
    WRITERS[program](tmp_path / "f", session.camera_names, list(POINTS), seen(session, [TRUTH]))
    observations = imported(session, tmp_path / "f", confidence=1.0 if program == "roboflow" else None)
    assert observations.format == FORMATS.get(program, program)
    rows = [k for k in range(N) if program != "hand labels" or k % 3 == 1]
    assert np.abs(in_space(session, observations)[rows] - TRUTH[rows]).max() < 1e-3
    expected = 1.0 if program in BY_HAND else 0.97 if program == "eks" else 0.9
    assert np.allclose(observations.points.confidence[observations.points.is_known], expected)


def test_sleaps_table_lists_pictures_with_somebody(session, tmp_path):
    write_sleap_csv(tmp_path / "f", session.camera_names, list(POINTS), seen(session, [TRUTH]))
    for path in (tmp_path / "f").iterdir():
        head, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, *rows[2:]]))
    observations = imported(session, tmp_path / "f")
    assert np.isnan(in_space(session, observations)[:2]).all()
    assert np.abs(in_space(session, observations)[2:] - TRUTH[2:]).max() < 1e-3


def test_tables_of_deeplabcut_from_a_spreadsheet_and_beside_metrics(session, tmp_path):
    write_eks(tmp_path / "f", session.camera_names, list(POINTS), seen(session, [TRUTH]))
    path = tmp_path / "f" / f"multicam_{session.camera_names[0]}_results.csv"
    (tmp_path / "f" / "metrics.csv").write_text(",left_wrist\n0,1\n")
    with pytest.raises(FormatError, match="or leave out those that hold no points"):
        planned(session, tmp_path / "f")
    path.write_text(path.read_text().replace(",", ";"))
    with pytest.raises(FormatError, match="found semicolons between cells; export it again, with commas"):
        planned(session, path)


@pytest.mark.parametrize("program", [name for name in WRITERS if name not in ("eks", "hand labels")])
def test_two_people(session, tmp_path, program):
    others = walking(N, start=(0.6, 0.8, 0.0))
    WRITERS[program](tmp_path / "f", session.camera_names, list(POINTS), seen(session, [TRUTH, others]))
    plan = planned(session, tmp_path / "f", confidence=1.0 if program == "roboflow" else None)
    assert not plan.problems
    assert {view.n_people for view in plan.views} == {2}


@pytest.mark.parametrize("n_cells", [1, 3])
def test_labels_of_a_person_lie_at_their_pictures(session, tmp_path, n_cells):
    write_hand_labels(tmp_path / "f", session.camera_names, POINTS, seen(session, [TRUTH]), n_cells)
    observations = imported(session, tmp_path / "f")
    assert np.flatnonzero(observations.points.is_known.any(axis=(1, 2, 3))).tolist() == [1, 4, 7]
    assert "labels were placed by the numbers of their pictures" in observations.notes[0]
    moved = planned(session, tmp_path / "f", first_frame=0)
    assert "placed at frame 0, as chosen, though the numbers of the labels are those of" in moved.observations.notes[0]
    wrong = tmp_path / "f" / "labeled-data" / "cam0" / "CollectedData_ann.csv"
    wrong.write_text(wrong.read_text().replace("img007", "img009"))
    (problem,) = planned(session, tmp_path / "f").problems
    assert "expected the 8 pictures of the footage, numbers 0 to 7, found numbers 1 to 9" in str(problem)


def test_single_points_of_cvat(session, tmp_path):
    write_cvat_points(tmp_path / "f", session.camera_names, POINTS, seen(session, [TRUTH]))
    observations = imported(session, tmp_path / "f")
    assert np.abs(in_space(session, observations)[1::2] - TRUTH[1::2]).max() < 1e-3
    assert not observations.points.is_known[::2].any()


def test_likelihoods_that_are_a_placeholder(session, tmp_path):
    write_eks(tmp_path / "f", session.camera_names, POINTS, seen(session, [TRUTH]), likelihood=0)
    observations = imported(session, tmp_path / "f")
    assert (observations.points.confidence[observations.points.is_known] == 1).all()
    assert sum("likelihoods are 0 throughout" in note for note in observations.notes) == 4
    assert sum("columns x_ens_median, y_posterior_var were left out" in note for note in observations.notes) == 4


def test_a_labelled_table_that_is_there_twice(session, tmp_path):
    """DeepLabCut writes each table as CSV and as HDF5."""
    write_hand_labels(tmp_path / "f", session.camera_names, POINTS, seen(session, [TRUTH]))
    for path in [*(tmp_path / "f").rglob("*.csv")]:
        path.with_suffix(".h5").write_bytes(b"the same")
    assert imported(session, tmp_path / "f").format == "deeplabcut"
    (tmp_path / "f" / "other.h5").write_bytes(b"another")
    with pytest.raises(FormatError, match="expected files of one format"):
        find_files((tmp_path / "f",))


def test_two_files_of_one_picture_are_two_people(session, tmp_path):
    others = walking(N, start=(0.6, 0.8, 0.0))
    for name, motion in (("a", TRUTH), ("b", others)):
        write_openpose(tmp_path / name, session.camera_names, seen(session, [motion]))
    for path in (tmp_path / "b").rglob("*.json"):
        number = path.name.split("_")[1]
        path.rename(tmp_path / "a" / path.parent.name / f"{path.parent.name}_{number}_person2.json")
    plan = planned(session, tmp_path / "a")
    assert not plan.problems
    assert [view.n_people for view in plan.views] == [2] * 4
    store_import(session, plan)
    assert len(list((session.folder / "observations" / "mp" / "files").rglob("*.json"))) == 2 * 4 * N


@pytest.mark.parametrize("name", ["mask_{k:05d}_obj{value}.png", "00{value}/{k:05d}.png"])
def test_masks_of_two_objects_are_two_values(tmp_path, name):
    session = make_session(tmp_path / "s", 3, people=("ann", "bob"), size=SIZE)
    masks = person_masks(3, 4, people=2)
    for v, camera in enumerate(session.camera_names):
        (tmp_path / "m" / camera).mkdir(parents=True)
        for k in range(3):
            for value in (1, 2) if k else (2,):  # the first object is not in the first picture
                one = np.where(masks[k, v] == value, 255, 0).astype(np.uint8)
                path = tmp_path / "m" / camera / name.format(k=k, value=value)
                path.parent.mkdir(exist_ok=True)
                image_of(one).save(path)
    plan = plan_import(session, ImportRequest("sam", (tmp_path / "m",), ("ann", "bob"), values={"ann": 1, "bob": 2}))
    assert not plan.problems
    assert plan.format == "masks"
    objects = "mask_obj1 = 1, mask_obj2 = 2" if "obj" in name else "001 = 1, 002 = 2"
    assert any(objects in note for note in plan.notes)
    assert np.array_equal(plan.mask("cam1", 2, SIZE), masks[2, 1])
    assert set(np.unique(plan.mask("cam1", 0, SIZE)).tolist()) == {0, 2}


def test_one_object_for_each_picture_needs_no_values(tmp_path):
    session = make_session(tmp_path / "s", 3, size=SIZE)
    masks = person_masks(3, 4)
    for v, camera in enumerate(session.camera_names):
        (tmp_path / "m" / camera).mkdir(parents=True)
        for k in range(3):
            image_of(masks[k, v] * 255).save(tmp_path / "m" / camera / f"{k:06d}_0.png")
    plan = plan_import(session, ImportRequest("sam", (tmp_path / "m",), ("ann",)))
    assert (plan.problems, plan.notes) == ((), ())


def test_an_object_with_the_number_of_a_camera(tmp_path):
    """Cameras are called 0 and 1, and so are objects; the names of all cameras may also be in one folder."""
    names = ("0", "1")
    files = [(tmp_path / camera / f"{k:06d}_0.png", tmp_path) for camera in names for k in range(3)]
    groups = numbered_groups(files, names)
    assert match_cameras([(g.labels, g.place) for g in groups], names, {}) == ["0", "1"]
    files = [(tmp_path / f"{camera}_{k:06d}.png", tmp_path) for camera in names for k in range(3)]
    groups = numbered_groups(files, names)
    assert match_cameras([(g.labels, g.files[0]) for g in groups], names, {}) == ["0", "1"]


@pytest.mark.parametrize("program", ["easymocap", "mmpose pictures", "yolo"])
def test_nobody_in_the_first_picture(session, tmp_path, program):
    WRITERS[program](tmp_path / "f", session.camera_names, list(POINTS), seen(session, [TRUTH]))
    for path in (tmp_path / "f").rglob("*000000.*"):
        path.write_text({"easymocap": '{"annots": []}', "mmpose pictures": "[]", "yolo": ""}[program])
    observations = imported(session, tmp_path / "f")
    assert np.flatnonzero(observations.points.is_known.any(axis=(1, 2, 3))).tolist() == list(range(1, N))


def test_names_with_a_rate(session, tmp_path):
    write_openpose(tmp_path / "k", session.camera_names, seen(session, [TRUTH]))
    for path in (tmp_path / "k").rglob("*.json"):
        path.rename(path.with_name(path.name.replace("keypoints", "30fps")))
    observations = imported(session, tmp_path / "k")
    assert np.abs(in_space(session, observations) - TRUTH).max() < 1e-3


@pytest.mark.parametrize(("program", "name"), [("eks", "x" * 300), ("sleap csv", "a\x0bb"), ("cvat images", "a&#10;b")])
def test_names_that_cannot_be_stored(session, tmp_path, program, name):
    names = [name, *POINTS[1:]]
    WRITERS[program](tmp_path / "f", session.camera_names, names, seen(session, [TRUTH]))
    with pytest.raises(FormatError, match="the files of camera 'cam0': expected a name of 1 to 200 characters"):
        planned(session, tmp_path / "f")


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a_1.json", '{"annots": 3}', "EasyMocap file .*'annots'"),
        ("a.json", '{"instance_info": [{"frame_id": 1, "instances": 2}]}', "mmpose file .*instances"),
        (
            "a.json",
            '[{"frame_id": 1, "instances": []}, {"frame_id": 1, "instances": []}]',
            "mmpose file .*each frame_id once",
        ),
        ("a_1.json", '[{"keypoints": [[1, 2]], "keypoint_scores": []}]', "mmpose file .*a score for each of 1 points"),
        ("a.json", '[{"image_id": "1.jpg", "keypoints": ["x"]}]', "AlphaPose file .*keypoints"),
        ("a.json", '[{"image_id": "x.jpg", "keypoints": [1, 2, 1]}]', "AlphaPose file .*the number of the picture"),
        ("a.json", '[{"data": {}, "annotations": [{"result": 1}]}]', "Label Studio file .*result"),
        ("a.json", '[{"data": {}, "annotations": []}]', "Label Studio file .*points with names.*found none"),
        ("a.xml", "<annotations><track><points frame='x'/></track></annotations>", "CVAT file .*whole number"),
        ("a.xml", "<annotations>", "CVAT file .*not valid XML"),
        (
            "a.xml",
            "<annotations><track label='n'><points frame='1' points='1,2;3,4'/></track></annotations>",
            "CVAT file .*x and y of a point",
        ),
        (
            "a.xml",
            "<annotations><track label='n'><points frame='1' points='1,2'/><points frame='1' points='1,2'/></track>"
            "</annotations>",
            "CVAT file .*'n' twice in a picture",
        ),
        ("a_1.txt", "0 .5 .5 .1 .1 .2 .3 1 .2 .3 x .4 .4 1\n", "YOLO file .*line 1: expected numbers"),
        ("a.csv", "track,frame_idx,instance.score,n.x,n.y\n", "SLEAP file .*NAME.x, NAME.y, NAME.score"),
        ("a.csv", "track,frame_idx,instance.score,n.x,n.y,n.score\nt,0,1,1,2\n", "SLEAP file .*line 2: expected 6 col"),
        ("a.csv", "track,frame_idx,instance.score,n.x,n.y,n.score\nt,0.5,1,1,2,1\n", "SLEAP file .*frame_idx"),
        ("a.csv", "track,frame_idx,instance.score,n.x,n.y,n.score\n", "SLEAP file .*no rows"),
        ("a.csv", "track,frame_idx,n.x,n.y,n.score\n" + "a" * 200_000, "SLEAP file .*line 2: field larger than"),
    ],
)
def test_messages_name_the_program_that_wrote_the_file(tmp_path, name, text, expected):
    (tmp_path / name).write_text(text)
    found, files = find_files((tmp_path / name,))
    with pytest.raises(FormatError, match=expected):
        PICTURE_FORMATS[found].read(files, ("a", "b"))


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.json", '{"version": 0.7, "bodies": [{"joints": []}]}', "of AlphaPose's formats of OpenPose, which is not"),
        ("a.json", '{"shapes": [], "imagePath": "a.png"}', "is of LabelMe, which is not read; export COCO"),
        ("a.mat", "MATLAB", "is of a MATLAB file, which is not read; export a CSV"),
        ("a.json", '{"a": 1, "b": 2}', "found JSON with the keys 'a, b'; export it in one of its formats"),
        (
            "a.json",
            '[{"image": "a.png", "annotation_id": 1}]',
            "of Label Studio's JSON-MIN, which is not read; export JSON",
        ),
        ("a.json", "{", "a.json is not valid JSON"),
        ("a.json", "[[1, 2]]", r"found JSON with \[\[1, 2\]\]"),
        ("notes.txt", "hello", "found one that begins with 'hello'"),
    ],
)
def test_files_that_are_not_read_are_named(tmp_path, name, text, expected):
    (tmp_path / name).write_text(text)
    for path in (tmp_path, tmp_path / name):
        with pytest.raises(FormatError, match=expected):
            find_files((path,))


def test_notes_beside_files_are_left_out(session, tmp_path):
    write_sleap_csv(tmp_path / "f", session.camera_names, POINTS, seen(session, [TRUTH]))
    (tmp_path / "f" / "notes.txt").write_text("hello")
    (tmp_path / "f" / "camera.xml").write_text("<opencv_storage/>")
    assert find_files((tmp_path / "f",))[0] == "sleap csv"
    (tmp_path / "f" / "settings.json").write_text("{}")
    with pytest.raises(
        FormatError, match=r"settings\.json: expected key points.*found JSON with \{\}; leave it out, or export it"
    ):
        find_files((tmp_path / "f",))


def yolo_person(points, dims, *more, box=None):
    """A line of a person with x, y, and a visibility if there are three dimensions; the box is around the points."""
    low, high = points.min(axis=0), points.max(axis=0)
    box = [*(low + high) / 2, *(high - low)] if box is None else box
    values = points if dims == 2 else np.column_stack([points, np.full(len(points), 0.9)])
    return " ".join(map(str, [0, *box, *values.ravel(), *more]))


@pytest.mark.parametrize("more", [(), (0.9,), (0.9, 3)])
@pytest.mark.parametrize("dims", [2, 3])
@pytest.mark.parametrize("n_points", [16, 17, 25, 26, 33])
def test_points_of_yolo_have_a_visibility_or_none(tmp_path, n_points, dims, more):
    points = np.random.default_rng(n_points).uniform((0.1, 0.2), (0.4, 0.9), (2, n_points, 2))
    (tmp_path / "a_1.txt").write_text("\n".join(yolo_person(p, dims, *more) for p in points))
    found = read_yolo(tmp_path / "a_1.txt")
    np.testing.assert_allclose([person.points[:, :2] for person in found], points)


def test_points_of_yolo_that_fit_both_readings_are_asked_about(tmp_path):
    points = np.random.default_rng(0).uniform((0.1, 0.2), (0.4, 0.9), (17, 2))
    (tmp_path / "a_1.txt").write_text(yolo_person(points, 3, box=(0.5, 0.5, 1, 1)))
    with pytest.raises(FormatError, match="17 points with a visibility or 25 without"):
        read_yolo(tmp_path / "a_1.txt")


def coco_of(n_names, n_annotations, **more):
    names = [f"n{i}" for i in range(n_names)]
    images = [{"id": k, "file_name": f"{k}.jpg"} for k in range(n_annotations)]
    annotations = [{"image_id": k, "keypoints": [1, 2, 0.5]} for k in range(n_annotations)]
    annotations[0] |= more
    return {"images": images, "annotations": annotations, "categories": [{"id": 1, "keypoints": names}]}


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (coco_of(1_000, 1_000), "expected 3000 numbers for 1000 key points, found 3"),
        (coco_of(1, 300, track_id="x" * 200_000), "names of people: expected at most 40000000 values"),
    ],
)
def test_small_files_take_little_memory(tmp_path, data, expected):
    (tmp_path / "c.json").write_text(json.dumps(data))
    tracemalloc.start()
    with pytest.raises(FormatError, match=expected):
        read_coco(tmp_path / "c.json")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 15_000_000


def test_stored_observations_keep_their_formats():
    """Sessions hold these names."""
    old = {"openpose", "coco", "deeplabcut", "hdf5", "trc", "c3d", "bvh", "csv", "masks", "coco masks"}
    assert old <= FORMATS_BY_NAME.keys()


def test_the_documents_list_all_programs():
    from architecture import ROOT

    assert observation_table() in (ROOT / "docs" / "log" / "observations.md").read_text()
    assert all(row.instead for row in UNREAD)


@pytest.mark.slow
def test_several_sessions_in_one_project_of_sleap(tmp_path):
    """The videos of each session have the same names."""
    sleap_io = pytest.importorskip("sleap_io")
    (tmp_path / "day2").mkdir()
    session = make_session(tmp_path / "day2" / "s", N)
    skeleton = sleap_io.Skeleton(list(POINTS), name="person")
    frames = []
    for day, motion in (("day1", TRUTH + 1), ("day2", TRUTH)):
        for v, camera in enumerate(session.camera_names):
            video = sleap_io.Video(f"D:\\lab\\{day}\\{camera}.mp4", open_backend=False)
            for k, (person,) in enumerate(seen(session, [motion])[:, v]):
                one = sleap_io.PredictedInstance.from_numpy(
                    person[:, :2], skeleton=skeleton, point_scores=person[:, 2], score=0.9
                )
                frames.append(sleap_io.LabeledFrame(video, k, [one]))
    (tmp_path / "p").mkdir()
    sleap_io.save_file(sleap_io.Labels(frames), str(tmp_path / "p" / "labels.slp"))
    plan = planned(session, tmp_path / "p")
    assert not plan.problems, plan.problems
    assert np.abs(in_space(session, plan.observations) - TRUTH).max() < 1e-4
    assert (
        sum("points of videos of other footage were left out: D:/lab/day1" in n for n in plan.observations.notes) == 1
    )
    elsewhere = make_session(tmp_path / "day3" / "s", N)
    with pytest.raises(FormatError, match="expected the pictures of camera 'cam0' once, found those of several videos"):
        planned(elsewhere, tmp_path / "p")
