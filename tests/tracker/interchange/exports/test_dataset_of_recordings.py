"""A dataset of several recordings: splits, numbers that are unique over all, people in several, refusals."""

import hashlib
import json
from dataclasses import replace

import pytest
from bodies import MODELS
from pycocotools.coco import COCO
from stored_motions import filmed, store_motion

from tracker.errors import FormatError, RecordingError, SessionError, TrackerError
from tracker.interchange.exports.datasets.card import format_card, shared_people
from tracker.interchange.exports.datasets.dataset import DatasetRecording, export_dataset, plan_dataset
from tracker.interchange.exports.datasets.splits import SPLITS, SplitChoice, divide, parse_splits, recording_names
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.session.store.annotation_store import AnnotationStore


def recording(tmp_path, name, bodies, **options):
    """A recording of ann, or of ann and bob, with pictures."""
    place = tmp_path / f"of_{name}"
    place.mkdir()
    session, _ = store_motion(place / name, [MODELS[b] for b in bodies], n_frames=2, **options)
    session = filmed(session, place)
    return DatasetRecording(name, lambda: read_motion(session, range(len(session.people))))


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """Three recordings: two of ann and bob in different bodies, one of ann alone with a gap."""
    tmp_path = tmp_path_factory.mktemp("three")
    return [
        recording(tmp_path, "walk", ["gavrila38", "gavrila22"]),
        recording(tmp_path, "run", ["gavrila22", "gavrila22"], seed=1),
        recording(tmp_path, "sit", ["gavrila38"], seed=2, gaps={(0, 1)}),
    ]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory, three):
    """A dataset of these, and a summary of each recording."""
    out = tmp_path_factory.mktemp("dataset") / "d"
    plan = plan_dataset(three, ExportOptions(), parse_splits(["sit=test"], "--split"))
    ticks = []
    summaries = export_dataset(plan, ExportOptions(), out, tick=lambda: ticks.append(1))
    assert len(ticks) == plan.labels.n_frames == 5
    return out, summaries


@pytest.mark.slow
def test_pycocotools_reads_the_files_of_all_recordings_as_one(tmp_path, three, dataset):
    out, summaries = dataset
    joined = {"images": [], "annotations": [], "categories": None}
    for one in three:
        path = out / "recordings" / one.name / "labels" / "coco.json"
        alone, found = COCO(str(path)), json.loads(path.read_text())
        assert len(alone.getImgIds()) == len(found["images"]) > 0
        assert joined["categories"] in (None, found["categories"])
        joined["categories"] = found["categories"]
        for image in found["images"]:
            image["file_name"] = f"recordings/{one.name}/{image['file_name']}"
        joined["images"] += found["images"]
        joined["annotations"] += found["annotations"]
    (tmp_path / "all.json").write_text(json.dumps(joined))
    coco = COCO(str(tmp_path / "all.json"))
    assert len(coco.imgs) == len(joined["images"]) == sum(s.labels.images for s in summaries) == 15
    assert len(coco.anns) == len(joined["annotations"]) == sum(s.labels.annotations for s in summaries)
    assert sorted(c["name"] for c in coco.loadCats(coco.getCatIds())) == ["gavrila22", "gavrila38", "person"]
    for a in coco.anns.values():
        (image,), (category,) = coco.loadImgs(a["image_id"]), coco.loadCats(a["category_id"])
        assert (out / image["file_name"]).is_file()
        assert len(a["keypoints"]) == 3 * len(category["keypoints"])
        assert a["area"] == coco.annToMask(a).sum()
    assert {(a["person"], a["track_id"]) for a in coco.anns.values()} == {("ann", 0), ("bob", 1)}


@pytest.mark.slow
def test_splits_card_provenance_and_checksums_are_of_all(dataset):
    out, summaries = dataset
    splits = {"train": ["walk", "run"], "validation": [], "test": ["sit"]}
    assert json.loads((out / "splits.json").read_text()) == splits
    rows = dict(line.split("  ")[::-1] for line in (out / "SHA256SUMS").read_text().splitlines())
    files = {p.relative_to(out).as_posix(): p for p in out.rglob("*") if p.is_file()}
    assert rows.keys() == files.keys() - {"SHA256SUMS"}
    assert all(rows[name] == hashlib.sha256(files[name].read_bytes()).hexdigest() for name in rows)
    card = (out / "README.md").read_text()
    for row in (
        "| recordings | 3 |", "| people | 2 |", "| frames | 5 of 6, at 25 per second |", "| labelled pictures | 15 |",
        "| train | 2 | walk, run |", "| test | 1 | sit |", "| ann | walk, run, sit | train, test |",
        "| bob | walk, run | train |", "| sit | sit | test | ann | 3 | 1 | 3 | 1 |",
    ):  # fmt: skip
        assert row in card
    assert shared_people(summaries) == [("ann", ["walk", "run", "sit"]), ("bob", ["walk", "run"])]
    index = json.loads((out / "provenance.json").read_text())["recordings"]
    assert list(index) == ["walk", "run", "sit"]
    assert all(json.loads((out / path).read_text())["people"]["ann"] for path in index.values())


def test_people_of_one_name_may_be_different(three, dataset):
    plan = plan_dataset(three, ExportOptions(), SplitChoice(), distinct_people=True)
    assert sorted(plan.labels.people.values()) == [0, 1, 2, 3, 4]
    summaries = [replace(s, people={n: plan.labels.people[s.name, n] for n in s.people}) for s in dataset[1]]
    assert shared_people(summaries) == []
    card = format_card(summaries, plan.splits, plan.choice.sentence, ExportOptions())
    assert "| people | 5 |" in card
    assert "None: each person has a `track_id`" in card


def test_a_refused_recording_leaves_nothing(tmp_path, three):
    before = sorted(tmp_path.iterdir())
    with_poses = three[2].read().session
    with AnnotationStore(with_poses.annotations_path) as store:
        store.undo()
    with pytest.raises(SessionError, match="expected poses of 'ann'"):
        plan_dataset(three, ExportOptions(), SplitChoice())
    with AnnotationStore(with_poses.annotations_path) as store:
        store.redo()
    # Footage that cannot be read shows only while the second recording is written.
    motion = three[1].read()
    cameras = [replace(c, footage=tmp_path / "missing") for c in motion.session.cameras]
    broken = replace(motion, session=replace(motion.session, cameras=tuple(cameras)))
    plan = plan_dataset([three[0], DatasetRecording("run", lambda: broken)], ExportOptions(), SplitChoice())
    with pytest.raises(RecordingError):
        export_dataset(plan, ExportOptions(), tmp_path / "d")
    assert sorted(tmp_path.iterdir()) == before
    (tmp_path / "d").mkdir()
    with pytest.raises(TrackerError, match="not to exist, found a folder"):
        export_dataset(plan, ExportOptions(), tmp_path / "d", overwrite=True)


def test_bodies_of_one_name_have_the_same_points(tmp_path, three):
    motion = three[1].read()
    people = [
        replace(p, poses={f: replace(x, body=_renamed(x.body, "gavrila38")) for f, x in p.poses.items()})
        for p in motion.people
    ]
    other = replace(motion, people=tuple(people))
    with pytest.raises(FormatError, match=r"bodies named 'gavrila38' with the same points .* other points in 'run'"):
        plan_dataset([three[0], DatasetRecording("run", lambda: other)], ExportOptions(), SplitChoice())


def _renamed(body, name):
    return replace(body, model=replace(body.model, name=name))


def test_recordings_are_divided_alike_in_any_order():
    names = [f"take_{i}" for i in range(20)]
    choice = parse_splits(["70:15:15", "take_3=test", "take_4=validation"], "--split")
    stretches = divide(names, choice)
    assert sorted(n for some in stretches.values() for n in some) == sorted(names)
    assert {s: len(n) for s, n in stretches.items()} == {"train": 12, "validation": 4, "test": 4}
    assert "take_3" in stretches["test"]
    assert "take_4" in stretches["validation"]
    again = divide(names[::-1], choice)
    assert {s: set(n) for s, n in again.items()} == {s: set(n) for s, n in stretches.items()}
    assert divide(names, SplitChoice()) == {"train": names, "validation": [], "test": []}


@pytest.mark.parametrize(("n", "expected"), [(1, [1, 0, 0]), (2, [2, 0, 0]), (3, [1, 1, 1]), (10, [7, 2, 1])])
def test_each_split_with_a_share_gets_a_recording_if_there_are_enough(n, expected):
    stretches = divide([f"r{i}" for i in range(n)], SplitChoice((70, 15, 15)))
    assert [len(stretches[s]) for s in SPLITS] == expected


@pytest.mark.parametrize(
    "words",
    [["70:30"], ["70:15:x"], ["0:0:0"], ["-1:1:1"], ["1:1:nan"], ["walk=dev"], ["=test"], ["a=test", "a=train"],
     ["1:1:1", "2:1:1"]],
)  # fmt: skip
def test_other_splits_are_refused(words):
    with pytest.raises(FormatError, match="expected --split as TRAIN:VALIDATION:TEST once"):
        parse_splits(words, "--split")
    with pytest.raises(FormatError, match="expected splits of the recordings a, b, found one of 'c'"):
        divide(["a", "b"], SplitChoice(named={"c": "test"}))


def test_recordings_are_named_after_their_folders(tmp_path):
    places = [tmp_path / x for x in ("lab/walk/session", "lab/run/session", "lab/sit", "gym/run/session")]
    assert recording_names(places) == ["walk_session", "lab_run_session", "sit", "gym_run_session"]
    with pytest.raises(FormatError, match="expected each session once"):
        recording_names([*places, tmp_path / "lab" / "." / "sit"])
