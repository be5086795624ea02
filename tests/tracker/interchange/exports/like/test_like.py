"""Imported files leave as they came; mended poses change their own points alone."""

import json

import numpy as np
import pytest
from joint_files import write_joints
from observed_files import write_c3d, write_coco_images, write_deeplabcut, write_points_csv, write_sleap
from observed_people import BODY_25, make_session, seen, write_openpose
from program_files import write_alphapose, write_eks, write_sleap_csv

from tracker.body.model import PosedBody
from tracker.errors import FormatError, Remedy, SessionError, TrackerError
from tracker.formats.c3d import read_c3d
from tracker.formats.joint_tables.layouts import read_joint_files
from tracker.formats.keypoints.coco_reading import read_coco
from tracker.formats.keypoints.deeplabcut import read_deeplabcut_csv
from tracker.formats.keypoints.detections import read_openpose
from tracker.formats.keypoints.hdf5 import patch_hdf5_apart, read_hdf5_apart
from tracker.formats.model_toml import format_model
from tracker.formats.trc import read_trc, write_trc
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.like.patched_files import export_patched
from tracker.interchange.observations.importing import plan_import, store_import, stored_pictures
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import load_observations, source_path
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

N = 10
EDITED = 6
OFFSET = np.array([0.0, 0.0, 0.03])


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


def poses(session):
    model = session.people[0].model
    rng = np.random.default_rng(3)
    # Upright on the floor, facing x, and hardly turning.
    upright = PosedBody(model, model.neutral())
    lift = -upright.points_world[:, 2].min()
    moves = 0.1 * rng.normal(size=(N, model.n_dofs))
    moves[:, :6] *= 0.1
    moves[:, 2] += lift
    return [PosedBody(model, model.retract(model.neutral(), move)) for move in moves]


@pytest.fixture
def bodies(session):
    return poses(session)


def observed(session, bodies, offset=OFFSET):
    """Points of a detector that is off by the same vector in the world; the bodies hardly turn."""
    names = BODY_25.points
    where = BODY_25.counterparts(names)
    model = session.people[0].model
    out = np.zeros((N, len(names), 3))
    for k, body in enumerate(bodies):
        centers = dict(zip(model.point_names, body.joint_centers_world, strict=True))
        for i, name in enumerate(names):
            own = [centers[p] for p in where[name] if p in centers]
            out[k, i] = np.mean(own, axis=0) + offset if own else centers["head"] + 0.01 * i
    return out


def store(session, bodies, edited=(EDITED,), joints=None, person="ann"):
    """Store poses; on edited frames all values are a person's, or those of some joints alone."""
    model = session.people[0].model
    by_hand = [joints is None or name.rpartition(".")[0] in joints for name in model.value_names]
    with AnnotationStore(session.annotations_path) as annotations:
        revision = annotations.add_model_revision(person, format_model(model))
        changes = [
            PoseChange(person, k, PoseRecord(b.values, tuple("manual" if k in edited and own else "tracked" for own in
            by_hand), revision, keyframe=k in edited,),) for k, b in enumerate(bodies)
        ]  # fmt: skip
        annotations.commit("Poses", changes)


def imported(session, path, **choices):
    return stored_as_asked(session, ImportRequest("mp", (path,), ("ann",), **choices))


def stored_as_asked(session, request):
    plan = plan_import(session, request)
    assert not plan.problems, plan.problems
    store_import(session, plan)
    return load_observations(session, "mp")


def sent_back(session, bodies, path, out, joints=None, **choices):
    """Store poses beside imported observations, and export them as they came."""
    observations = imported(session, path)
    store(session, bodies, joints=joints)
    return export_patched(session, observations, out, **choices)


def write_kind(kind, session, folder, truth):
    """Write observations of a format; return the path to import and the choices."""
    if kind in NEEDS:
        pytest.importorskip(NEEDS[kind])
    points = seen(session, [truth])
    if kind == "openpose":
        return write_openpose(folder / "k", session.camera_names, points), {}
    if kind.startswith("coco"):
        of = kind.removeprefix("coco").strip() or "scores"
        write_coco_images(folder / "c.json", session.camera_names, BODY_25.points, points, of)
        return folder / "c.json", {}
    if kind.startswith("dlc"):
        for v, name in enumerate(session.camera_names):
            write_deeplabcut(folder / "d" / name, BODY_25.points, points[:, v], kind.removeprefix("dlc "))
        return folder / "d", {}
    if kind in ("sleap", "nwb"):
        for v, name in enumerate(session.camera_names):
            write_sleap(folder / kind / f"{name}{SUFFIXES[kind]}", BODY_25.points, points[:, v])
        return folder / kind, {}
    if kind == "trc":
        write_trc(folder / "a.trc", BODY_25.points, truth, 30.0, units="mm")
        return folder / "a.trc", {}
    if kind == "trc utf-16":
        write_trc(folder / "b.trc", BODY_25.points, truth, 30.0)
        (folder / "a.trc").write_bytes((folder / "b.trc").read_text().replace("\n", "\r\n").encode("utf-16"))
        return folder / "a.trc", {}
    if kind == "csv":
        write_points_csv(folder / "a.csv", BODY_25.points, truth, 30.0, "mm")
        return folder / "a.csv", {}
    write_c3d(folder / "a.c3d", BODY_25.points, truth, 30.0)
    return folder / "a.c3d", {}


KINDS = [
    *("openpose", "coco", "dlc csv", "dlc multi", "trc", "trc utf-16", "csv", "c3d"),
    *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("dlc h5", "sleap", "nwb")),
]
NEEDS = {"dlc h5": "h5py", "sleap": "sleap_io", "nwb": "sleap_io", "c3d": "ezc3d"}
SUFFIXES = {"dlc h5": ".h5", "sleap": ".slp", "nwb": ".nwb"}


def read_space(path):
    return {
        ".trc": read_trc,
        ".csv": lambda p: read_joint_files([p], None, 30.0)[0][1],
        ".c3d": lambda p: read_c3d(p, None),
    }[path.suffix](path)


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("kind", KINDS)
def test_untouched_files_leave_as_they_came(session, tmp_path, kind):
    path, choices = write_kind(kind, session, tmp_path, observed(session, poses(session)))
    before = contents(path) if path.is_dir() else path.read_bytes()
    observations = imported(session, path, **choices)
    done = export_patched(session, observations, tmp_path / f"back{path.suffix}")
    after = contents(tmp_path / "back") if path.is_dir() else (tmp_path / f"back{path.suffix}").read_bytes()
    assert after == before
    assert (done.changed, done.frames) == ((), ())


@pytest.mark.parametrize("kind", ["trc", "trc utf-16", "csv", "c3d"])
def test_a_mended_frame_alone_differs_in_space(session, tmp_path, kind, bodies):
    truth = observed(session, bodies)
    wrong = truth.copy()
    wrong[EDITED] += 0.2
    path, _ = write_kind(kind, session, tmp_path, wrong)
    out = tmp_path / f"back{path.suffix}"
    done = sent_back(session, bodies, path, out)
    assert done.frames == (EDITED,)
    before, after = read_space(path), read_space(out)
    assert before.names == after.names
    others = np.arange(N) != EDITED
    assert np.array_equal(before.points[others], after.points[others])
    mapped = [i for i, points in enumerate(BODY_25.counterparts(BODY_25.points).values()) if points]
    assert np.abs(after.points[EDITED][mapped] - truth[EDITED][mapped]).max() < 0.015  # bodies turn a little
    rest = [i for i in range(25) if i not in mapped]
    assert np.array_equal(after.points[EDITED][rest], before.points[EDITED][rest])
    one, other = path.read_bytes(), out.read_bytes()
    if kind.startswith("trc"):  # line by line, and its ends
        encoding = "utf-16" if "utf-16" in kind else "utf-8"
        lines = zip(one.decode(encoding).split("\n"), other.decode(encoding).split("\n"), strict=True)
        assert [i for i, (a, b) in enumerate(lines) if a != b] == [6 + EDITED]
    if kind == "c3d":
        assert len(one) == len(other)


@pytest.mark.parametrize("kind", ["openpose", "trc"])
def test_points_that_did_not_move_with_the_edit_stay(session, tmp_path, kind, bodies):
    path, _ = write_kind(kind, session, tmp_path, observed(session, bodies) + 0.2)
    out, joints = tmp_path / f"back{path.suffix}", ("left_elbow", "right_hip")
    done = sent_back(session, bodies, path, out, joints, learn_offsets=False)
    assert done.frames == (EDITED,)
    if kind == "trc":
        before, after = read_trc(path).points[EDITED], read_trc(done.paths[0]).points[EDITED]
    else:
        name = f"cam1/cam1_{EDITED:012d}_keypoints.json"
        before, after = (read_openpose(folder / name)[0].points for folder in (path, tmp_path / "back"))
    differ = {n for n, a, b in zip(BODY_25.points, before, after, strict=True) if not np.array_equal(a, b)}
    assert differ == {"LWrist", "RKnee", "RAnkle", "RHeel", "RBigToe"}


@pytest.mark.parametrize("learn", [True, False])
def test_offsets_are_learnt_or_plain(session, tmp_path, learn, bodies):
    truth = observed(session, bodies)
    write_trc(tmp_path / "a.trc", BODY_25.points, truth, 30.0)
    sent_back(session, bodies, tmp_path / "a.trc", tmp_path / "b.trc", learn_offsets=learn)
    knee = BODY_25.points.index("LKnee")
    off = np.linalg.norm(read_trc(tmp_path / "b.trc").points[EDITED, knee] - truth[EDITED, knee])
    assert off < 0.01 if learn else off == pytest.approx(0.03, abs=1e-4)


@pytest.mark.parametrize("kind", ["openpose", "dlc csv", "dlc multi"])
def test_a_mended_frame_alone_differs_in_pictures(session, tmp_path, kind, bodies):
    truth = observed(session, bodies, np.zeros(3))
    path, _ = write_kind(kind, session, tmp_path, truth + (np.arange(N) == EDITED)[:, None, None] * 0.2)
    done = sent_back(session, bodies, path, tmp_path / "back")
    assert done.frames == (EDITED,)
    before, after = contents(path), contents(tmp_path / "back")
    knee = BODY_25.points.index("LKnee")
    for source in session.cameras:
        camera = source.camera
        expected = project_through_lens(camera, truth[EDITED, knee : knee + 1])[0]
        if kind == "openpose":
            name = f"{camera.name}/{camera.name}_{EDITED:012d}_keypoints.json"
            (person,) = read_openpose(tmp_path / "back" / name)
            found, nose = person.points[knee], person.points[0]
            before_nose = read_openpose(path / name)[0].points[0]
        else:
            name = f"{camera.name}.csv"
            table = read_deeplabcut_csv(tmp_path / "back" / name)
            found, nose = table.points[EDITED, 0, knee], table.points[EDITED, 0, 0]
            before_nose = read_deeplabcut_csv(path / name).points[EDITED, 0, 0]
            lines = zip(before[name].split(b"\n"), after[name].split(b"\n"), strict=True)
            assert [i for i, (a, b) in enumerate(lines) if a != b] == [EDITED + (3 if kind == "dlc csv" else 4)]
        assert np.abs(found[:2] - expected).max() < 0.1
        assert found[2] == 1.0
        assert np.array_equal(nose, before_nose)
    differ = {name for name in before if before[name] != after[name]}
    if kind == "openpose":
        assert differ == {f"{c}/{c}_{EDITED:012d}_keypoints.json" for c in session.camera_names}


def numbers_of(path):
    """The images of a COCO file by id, and the annotations by the image's file name."""
    data = json.loads(path.read_text())
    images = {i["id"]: i for i in data["images"]}
    return data, {
        (images[a["image_id"]].get("camera"), images[a["image_id"]]["file_name"]): a for a in data["annotations"]
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*SUFFIXES])
def test_mended_points_of_hdf5_alone_differ(session, tmp_path, kind, bodies):
    truth = observed(session, bodies, np.zeros(3))
    path, _ = write_kind(kind, session, tmp_path, truth + (np.arange(N) == EDITED)[:, None, None] * 0.2)
    done = sent_back(session, bodies, path, tmp_path / "back", ("left_hip",))
    assert done.frames == (EDITED,)
    assert len(done.changed) == len(session.cameras)
    names, knee, suffix = BODY_25.points, BODY_25.points.index("LKnee"), SUFFIXES[kind]
    for source in session.cameras:
        ((_, before),), ((_, after),) = (
            read_hdf5_apart(folder / f"{source.camera.name}{suffix}") for folder in (path, tmp_path / "back")
        )
        assert (before.names, before.numbers.tolist()) == (after.names, after.numbers.tolist())
        differ = np.argwhere((before.points != after.points).any(axis=-1)).tolist()
        assert {(k, names[i]) for k, _, i in differ} == {(EDITED, n) for n in ("LKnee", "LAnkle", "LHeel", "LBigToe")}
        expected = project_through_lens(source.camera, truth[EDITED, knee : knee + 1])[0]
        assert np.abs(after.points[EDITED, 0, knee, :2] - expected).max() < 0.1


SOME = ("hip", "knee", "ankle")


def sleap_people(n_people):
    """Points of some people on four pictures, (4, n_people, 3, 3); the first person has no knee on picture 1."""
    points = np.random.default_rng(1).uniform(50, 400, (4, n_people, len(SOME), 3))
    points[..., 2] = 0.75
    points[1, 0, 1] = np.nan
    return points


MENDED = np.array([[10.0, 20.0, 1.0], [np.nan] * 3, [0.0, 0.0, 0.0]])
"""A point elsewhere, one that stays, one that is absent."""


def changed_points(path, changes):
    """Points of the first video before and after a change, and of the file without its changed points."""
    ((_, before),) = read_hdf5_apart(path)
    path.with_name(f"new{path.suffix}").write_bytes(patch_hdf5_apart(path, {0: changes}))
    ((_, after),) = read_hdf5_apart(path.with_name(f"new{path.suffix}"))
    assert (before.names, before.numbers.tolist()) == (after.names, after.numbers.tolist())
    return before.points, after.points


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "version"), [(".slp", None), (".slp", 1.0), (".h5", None), (".nwb", None)])
def test_mended_points_of_sleap_alone_differ(tmp_path, suffix, version):
    pytest.importorskip("sleap_io")
    write_sleap(tmp_path / f"a{suffix}", SOME, sleap_people(1))
    if version is not None:
        with pytest.importorskip("h5py").File(tmp_path / f"a{suffix}", "r+") as file:
            file["metadata"].attrs["format_id"] = version
            rows = file["instances"][:]
            del file["instances"]
            file["instances"] = rows[[name for name in rows.dtype.names if name != "tracking_score"]]
    before, after = changed_points(tmp_path / f"a{suffix}", {2: [(0, MENDED)]})
    assert {(k, i) for k, _, i in np.argwhere((before != after).any(axis=-1) & ~np.isnan(before[..., 0]))} == {
        (2, 0), (2, 2),
    }  # fmt: skip
    assert after[2, 0, 0].tolist() == [10.0, 20.0, 1.0]
    assert np.isnan(after[2, 0, 2, :2]).all()


@pytest.mark.slow
def test_a_person_whom_sleap_did_not_find_is_added_to_one_picture(tmp_path):
    sleap_io = pytest.importorskip("sleap_io")
    write_sleap(tmp_path / "a.slp", SOME, sleap_people(2))
    before, after = changed_points(tmp_path / "a.slp", {1: [(-1, MENDED), (1, MENDED)]})
    others = [0, 2, 3]
    assert np.array_equal(before[others], after[others, :2], equal_nan=True)
    assert after.shape[1] == 3
    assert sorted(after[1, :, 0, 0].tolist()) == sorted([10.0, 10.0, before[1, 0, 0, 0]])
    labels = sleap_io.load_slp(str(tmp_path / "new.slp"), open_videos=False)
    (picture,) = (f for f in labels.labeled_frames if f.frame_idx == 1)
    assert (len(picture.user_instances), len(picture.predicted_instances)) == (1, 2)


@pytest.mark.slow
def test_an_analysis_has_no_track_for_one_more_person(tmp_path):
    pytest.importorskip("sleap_io")
    write_sleap(tmp_path / "a.h5", SOME, sleap_people(1))
    with pytest.raises(FormatError, match="expected a track for a person who was not found on frame 1, found none"):
        patch_hdf5_apart(tmp_path / "a.h5", {0: {1: [(0, MENDED), (-1, MENDED)]}})


@pytest.mark.slow
def test_nwb_gets_a_point_that_was_not_found_and_stays_valid(tmp_path):
    pytest.importorskip("sleap_io")
    pynwb = pytest.importorskip("pynwb")
    write_sleap(tmp_path / "a.nwb", SOME, sleap_people(1))
    knee = np.array([[np.nan] * 3, [33.0, 44.0, 1.0], [np.nan] * 3])
    before, after = changed_points(tmp_path / "a.nwb", {1: [(0, knee)]})
    assert np.isnan(before[1, 0, 1, :2]).all()
    assert after[1, 0, 1].tolist() == [33.0, 44.0, 1.0]
    after[1, 0, 1] = before[1, 0, 1]
    assert np.array_equal(before, after, equal_nan=True)
    assert pynwb.validate(path=str(tmp_path / "new.nwb")) == []
    with pytest.raises(FormatError, match="expected a free person for one who was not found in picture 1, found none"):
        patch_hdf5_apart(tmp_path / "a.nwb", {0: {1: [(0, MENDED), (-1, MENDED)]}})


@pytest.mark.slow
def test_points_of_other_hdf5_files_are_not_replaced(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "tracks.h5", "w") as file:
        file["tracks"] = np.zeros((1, 2, 25, N))
    with pytest.raises(FormatError, match="expected a project or an analysis of SLEAP, or a table of") as raised:
        patch_hdf5_apart(tmp_path / "tracks.h5", {0: {0: [(0, np.zeros((25, 3)))]}})
    assert raised.value.remedy == Remedy("export_other_format")


@pytest.mark.parametrize("kind", ["coco scores", "coco cameras"])
def test_mended_points_of_coco_alone_differ(session, tmp_path, kind, bodies):
    truth = observed(session, bodies, np.zeros(3))
    path, _ = write_kind(kind, session, tmp_path, truth + (np.arange(N) == EDITED)[:, None, None] * 0.2)
    done = sent_back(session, bodies, path, tmp_path / "back.json", ("left_hip",))
    assert done.frames == (EDITED,)
    (one, before), (other, after) = numbers_of(path), numbers_of(tmp_path / "back.json")
    assert {k: v for k, v in one.items() if k != "annotations"} == {
        k: v for k, v in other.items() if k != "annotations"
    }
    changed = {key for key in before if before[key] != after[key]}
    assert len(changed) == len(session.cameras)
    assert all(f"{EDITED:06d}" in name for _, name in changed)
    knee = BODY_25.points.index("LKnee")
    for source in session.cameras:
        name = source.camera.name
        key = (name, f"{EDITED:06d}.jpg") if kind == "coco cameras" else (None, f"{name}/{EDITED:06d}.jpg")
        old, new = (np.reshape(found[key].pop("keypoints"), (-1, 3)) for found in (before, after))
        assert before[key] == after[key]
        differ = {n for n, a, b in zip(BODY_25.points, old, new, strict=True) if (a != b).any()}
        assert differ == {"LKnee", "LAnkle", "LHeel", "LBigToe"}
        expected = project_through_lens(source.camera, truth[EDITED, knee : knee + 1])[0]
        assert np.abs(new[knee, :2] - expected).max() < 0.1
        assert new[knee, 2] == (2 if kind == "coco cameras" else 1)  # a flag, or a confidence


def test_mended_points_of_alphapose_alone_differ(session, tmp_path, bodies):
    write_alphapose(tmp_path / "f", session.camera_names, BODY_25.points, seen(session, [observed(session, bodies)]))
    sent_back(session, bodies, tmp_path / "f", tmp_path / "back")
    for camera in session.camera_names:
        name = f"{camera}/alphapose-results.json"
        before, after = (json.loads((tmp_path / folder / name).read_text()) for folder in ("f", "back"))
        assert [a == b for a, b in zip(before, after, strict=True)] == [k != EDITED for k in range(N)]
        assert before[EDITED] | {"keypoints": []} == after[EDITED] | {"keypoints": []}


def test_other_columns_of_a_table_stay(session, tmp_path, bodies):
    write_eks(tmp_path / "f", session.camera_names, BODY_25.points, seen(session, [observed(session, bodies)]))
    sent_back(session, bodies, tmp_path / "f", tmp_path / "back")
    name = f"multicam_{session.camera_names[1]}_results.csv"
    before, after = ((tmp_path / folder / name).read_text().splitlines() for folder in ("f", "back"))
    assert [a == b for a, b in zip(before, after, strict=True)] == [k != EDITED + 3 for k in range(N + 3)]
    rows = [line.split(",") for line in (before[2], before[EDITED + 3], after[EDITED + 3])]
    changed = {head for head, a, b in zip(*rows, strict=True) if a != b}
    assert changed == {"x", "y", "likelihood"}


def test_several_files_of_one_picture_are_not_sent_back(session, tmp_path, bodies):
    write_openpose(tmp_path / "k", session.camera_names, seen(session, [observed(session, bodies)]))
    for path in [*(tmp_path / "k").rglob("*.json")]:
        path.with_name(path.name.replace("keypoints", "person2")).write_text('{"people": []}')
    with pytest.raises(FormatError, match="expected files with one picture each, found several of one"):
        sent_back(session, bodies, tmp_path / "k", tmp_path / "back")


def test_programs_to_which_nothing_is_sent_back(session, tmp_path, bodies):
    write_sleap_csv(tmp_path / "f", session.camera_names, BODY_25.points, seen(session, [observed(session, bodies)]))
    observations = imported(session, tmp_path / "f")
    export_patched(session, observations, tmp_path / "untouched")
    store(session, bodies)
    with pytest.raises(FormatError, match="to which points are sent back, found SLEAP's analysis in CSV") as caught:
        export_patched(session, observations, tmp_path / "back")
    assert caught.value.remedy == Remedy("export_other_format")


@pytest.mark.parametrize("kind", ["coco scores", "coco cameras"])
def test_a_person_is_added_to_coco_and_read_again(session, tmp_path, kind, bodies):
    path, _ = write_kind(kind, session, tmp_path, observed(session, bodies, np.zeros(3)))
    data = json.loads(path.read_text())
    missing = next(a for a in data["annotations"] if a["image_id"] == N + EDITED + 1)  # the second camera
    data["annotations"].remove(missing)
    path.write_text(json.dumps(data))
    sent_back(session, bodies, path, tmp_path / "back.json")
    _, table = read_coco(tmp_path / "back.json")[1]
    assert table.is_found[EDITED, 0, BODY_25.points.index("LKnee")]
    added = json.loads((tmp_path / "back.json").read_text())["annotations"][-1]
    assert added["image_id"] == missing["image_id"]
    assert added["num_keypoints"] == sum(v > 0 for v in added["keypoints"][2::3]) > 10
    assert added["id"] > max(a["id"] for a in data["annotations"])


def test_a_count_of_points_follows_those_that_are_gone(session, tmp_path, bodies):
    path, _ = write_kind("coco cameras", session, tmp_path, observed(session, bodies, np.zeros(3)))
    data = json.loads(path.read_text())
    for annotation in data["annotations"]:
        annotation["num_keypoints"] = 25
    path.write_text(json.dumps(data))
    sent_back(session, gone_right(session, bodies), path, tmp_path / "back.json")
    _, after = numbers_of(tmp_path / "back.json")
    gone = after["cam1", f"{EDITED:06d}.jpg"]
    assert gone["num_keypoints"] == sum(v > 0 for v in gone["keypoints"][2::3]) < 25


def gone_right(session, bodies):
    """Return the bodies with that of the edited frame far to the right of the second camera."""
    away = bodies[EDITED].values.copy()
    away[:2] += 30 * session.cameras[1].camera.T_world_camera[:2, 0]
    moved = PosedBody(session.people[0].model, away)
    return [moved if k == EDITED else b for k, b in enumerate(bodies)]


@pytest.mark.parametrize("is_seen", [True, False])
def test_a_person_who_was_not_found_is_added_where_the_picture_shows_them(session, tmp_path, bodies, is_seen):
    points = seen(session, [observed(session, bodies, np.zeros(3))])
    points[EDITED, 1] = (np.nan, np.nan, 0)
    path = write_openpose(tmp_path / "k", session.camera_names, points)
    sent_back(session, bodies if is_seen else gone_right(session, bodies), path, tmp_path / "back")
    people = read_openpose(tmp_path / "back" / "cam1" / f"cam1_{EDITED:012d}_keypoints.json")
    assert [len(person.points) for person in people] == [25] * is_seen
    for person in people:
        assert np.isnan(person.points[0]).tolist() == [True, True, False]  # the nose is no joint of the body


def test_all_poses(session, tmp_path, bodies):
    write_trc(tmp_path / "a.trc", BODY_25.points, observed(session, bodies), 30.0)
    done = sent_back(session, bodies, tmp_path / "a.trc", tmp_path / "b.trc", poses="all")
    assert done.frames == tuple(range(N))


def test_choices_of_the_import_hold_on_the_way_back(session, tmp_path, bodies):
    truth = observed(session, bodies, np.zeros(3))
    half = seen(session, [truth]) * [0.5, 0.5, 1] - [0.25, 0.25, 0]
    path = write_openpose(tmp_path / "k", session.camera_names, half[2:])
    store(session, bodies)
    observations = imported(session, path, first_frame=2, picture_size=(320, 240))
    export_patched(session, observations, tmp_path / "back")
    name = f"cam0/cam0_{EDITED - 2:012d}_keypoints.json"
    one, other = (read_openpose(folder / name)[0].points for folder in (path, tmp_path / "back"))
    assert np.abs(one[:, :2] - other[:, :2]).max() < 0.01


def test_axes_and_units_of_the_file(session, tmp_path, bodies):
    truth = observed(session, bodies)
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # y of the file points up
    write_trc(tmp_path / "a.trc", BODY_25.points, truth @ turn.T, 30.0, units="mm")
    store(session, bodies)
    export_patched(session, imported(session, tmp_path / "a.trc", axes="x,-z,y"), tmp_path / "b.trc")
    one, other = read_trc(tmp_path / "a.trc"), read_trc(tmp_path / "b.trc")
    assert np.abs(one.points - other.points).max() < 0.015
    assert not np.array_equal(one.points[EDITED], other.points[EDITED])


def test_folders_of_equal_names_stay_apart(session, tmp_path):
    """Files are only numbered, and one camera has more of them than another."""
    points = seen(session, [observed(session, poses(session))])
    write_openpose(tmp_path / "k", session.camera_names, points)
    folders = [tmp_path / "k" / name for name in session.camera_names]
    for v, folder in enumerate(folders):
        for i, file in enumerate(sorted(folder.iterdir())):
            file.rename(folder / f"{i:06d}_keypoints.json")
        if v == 0:
            (folder / f"{N - 1:06d}_keypoints.json").unlink()
    request = ImportRequest("mp", tuple(folders), ("ann",), first_frame=0)
    found = stored_pictures(session, stored_as_asked(session, request))
    assert [(p.camera, len(p.files)) for p in found] == [
        (name, N - (v == 0)) for v, name in enumerate(session.camera_names)
    ]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_mark_of_the_byte_order_stays(session, tmp_path, encoding, bodies):
    path, _ = write_kind("openpose", session, tmp_path, observed(session, bodies))
    for file in path.rglob("*.json"):
        file.write_text(file.read_text(), encoding=encoding)
    done = sent_back(session, bodies, path, tmp_path / "back", learn_offsets=False)
    assert done.frames == (EDITED,)
    (one, *_) = sorted((tmp_path / "back").rglob(f"*{EDITED:012d}*.json"))
    assert len(json.loads(one.read_text(encoding=encoding))["people"]) == 1


def test_each_person_has_the_rows_of_their_own_file(tmp_path):
    session = make_session(tmp_path / "s", N, people=("ann", "bob"))
    bodies, late = poses(session), 4
    wrong = observed(session, bodies)
    wrong[EDITED] += 0.2
    paths = (tmp_path / "ann.trc", tmp_path / "bob.trc")
    for path, first in zip(paths, (0, late), strict=True):
        write_trc(path, BODY_25.points, wrong[first:], session.fps, frames=np.arange(first, N))
    observations = stored_as_asked(session, ImportRequest("mp", paths, ("ann", "bob")))
    store(session, bodies, person="bob")
    export_patched(session, observations, tmp_path / "out")
    assert (tmp_path / "out" / "ann.trc").read_bytes() == paths[0].read_bytes()
    before, after = read_trc(paths[1]), read_trc(tmp_path / "out" / "bob.trc")
    moved = np.abs(before.points - after.points).max(axis=(1, 2))
    assert np.flatnonzero(moved > 0.1).tolist() == [EDITED - late]


@pytest.mark.parametrize("kind", ["people", "semicolon", "deeplabcut", "c3d", "easymocap"])
def test_points_of_other_layouts_are_not_written_back(session, tmp_path, kind, bodies):
    truth = observed(session, bodies)
    path = write_joints(kind, tmp_path, BODY_25.points, np.stack([truth, truth][: 1 + (kind in ("people", "c3d"))]))
    observations = imported(session, path, unit_m=1.0)
    store(session, bodies)
    with pytest.raises(TrackerError, match=r"points are written back, found .*; export the poses as TRC or CSV"):
        export_patched(session, observations, tmp_path / "out")


def test_rows_at_another_rate_are_where_their_time_is(session, tmp_path):
    at = 0.3 + np.arange(4 * (N - 2)) / 4  # from between two frames, four times as many a second
    truth = observed(session, poses(session))
    share = (at % 1)[:, None, None]
    points = (1 - share) * truth[at.astype(int)] + share * truth[at.astype(int) + 1]
    path = tmp_path / "p.csv"
    write_points_csv(path, BODY_25.points, points, 4 * session.fps, "m")
    head, *rows = [line.split(",") for line in path.read_text().splitlines()]
    rows = [[row[0], f"{x / session.fps:.9f}", *row[2:]] for row, x in zip(rows, at, strict=True)]
    path.write_text("\n".join(map(",".join, [head, *rows])))
    np.testing.assert_allclose(imported(session, path, clock="time").row_frames, [at], atol=1e-6)


def test_a_stored_file_that_was_changed(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, observed(session, poses(session)), 30.0)
    observations = imported(session, tmp_path / "a.trc")
    path = source_path(session, "mp", observations.sources[0])
    path.write_text(path.read_text() + "\n")
    with pytest.raises(SessionError, match="is not as it was imported"):
        export_patched(session, observations, tmp_path / "b.trc")
    path.unlink()
    with pytest.raises(SessionError, match="cannot read the imported file"):
        export_patched(session, observations, tmp_path / "b.trc")


def test_nothing_is_replaced(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, observed(session, poses(session)), 30.0)
    observations = imported(session, tmp_path / "a.trc")
    with pytest.raises(TrackerError, match="not to exist, found a file"):
        export_patched(session, observations, tmp_path / "a.trc")
    assert json.dumps([p.name for p in tmp_path.iterdir() if p.name.endswith(".tmp")]) == "[]"
