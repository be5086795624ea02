"""Names that files give people from picture to picture come with their key points."""

import json

import numpy as np
import pytest
from observed_files import write_coco_images, write_deeplabcut, write_sleap
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.interchange.observations.importing import plan_import
from tracker.interchange.observations.plans import ImportRequest

N = 3
MOTIONS = [walking(N), walking(N, start=(-0.5, 0.8, 0.0))]


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N, people=("ann", "bob"))


def tracks(session, path):
    request = ImportRequest("mp", (path,), ("ann", "bob"), confidence=0.9)
    return plan_import(session, request, calibrated=False).observations.points.tracks


def test_openpose_numbers_of_people_are_their_names_and_minus_one_is_none(session, tmp_path):
    folder = write_openpose(tmp_path / "k", session.camera_names, seen(session, MOTIONS))
    assert not tracks(session, folder).astype(bool).any()
    for path in folder.rglob("*.json"):
        data = json.loads(path.read_text())
        data["people"][0]["person_id"], data["people"][1]["person_id"] = [4], "odd"
        path.write_text(json.dumps(data))
    assert np.array_equal(tracks(session, folder), np.broadcast_to(["4", ""], (N, 4, 2)))


def test_coco_has_track_ids(session, tmp_path):
    write_coco_images(tmp_path / "a.json", session.camera_names, BODY_25.points, seen(session, MOTIONS), "cameras")
    data = json.loads((tmp_path / "a.json").read_text())
    for annotation in data["annotations"]:
        annotation["track_id"] = annotation["id"] % 2
    (tmp_path / "a.json").write_text(json.dumps(data))
    assert np.array_equal(tracks(session, tmp_path / "a.json"), np.broadcast_to(["0", "1"], (N, 4, 2)))


def test_deeplabcut_has_individuals(session, tmp_path):
    points = seen(session, MOTIONS)
    for v, name in enumerate(session.camera_names):
        write_deeplabcut(tmp_path / "dlc" / name, BODY_25.points, points[:, v], "multi")
    assert np.array_equal(tracks(session, tmp_path / "dlc"), np.broadcast_to(["animal0", "animal1"], (N, 4, 2)))


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "name"), [(".slp", "one"), (".nwb", "track=one")])
def test_sleap_has_tracks_and_nwb_series(session, tmp_path, suffix, name):
    pytest.importorskip("sleap_io")
    points = seen(session, MOTIONS[:1])
    for v, camera in enumerate(session.camera_names):
        write_sleap(tmp_path / "sleap" / f"{camera}{suffix}", BODY_25.points, points[:, v])
    assert np.array_equal(tracks(session, tmp_path / "sleap"), np.full((N, 4, 1), name))
