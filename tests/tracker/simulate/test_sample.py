"""The bundled sample: small, complete, movable, and what its recipe makes."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tracker.footage import open_footage
from tracker.formats.model_toml import load_model
from tracker.formats.pose_table import read_pose_table
from tracker.formats.trc import read_trc
from tracker.session import load_session
from tracker.simulate.acting import perform
from tracker.simulate.film import film, freeze
from tracker.simulate.rig import make_cameras
from tracker.simulate.room import see_room
from tracker.simulate.scenes import cast_of

SAMPLE = Path(__file__).parents[3] / "sample_sessions" / "elbow_rotation"


@pytest.fixture(scope="module")
def session():
    return load_session(SAMPLE)


def test_it_is_small_and_holds_no_store():
    files = [p for p in SAMPLE.rglob("*") if p.is_file()]
    assert sum(p.stat().st_size for p in files) <= 6e6
    assert {p.suffix for p in files} == {".toml", ".mp4", ".png", ".trc", ".csv"}


def test_its_paths_are_relative_and_stay_within(session):
    data = tomllib.loads((SAMPLE / "session.toml").read_text("utf-8"))
    for camera in data["cameras"]:
        for path in (camera["footage"], camera["background"]):
            assert re.fullmatch(r"[\w/]+\.\w+", path)
            assert (SAMPLE / path).is_file()


def test_its_footage_and_truth_have_fifty_frames(session):
    assert [c.camera.name for c in session.cameras] == ["FRONT", "RIGHT", "BACK", "LEFT"]
    assert session.n_frames == 50
    for source in session.cameras:
        assert open_footage(source.footage, source.camera.name).n_frames == 50
    assert len(read_trc(SAMPLE / "truth.trc").points) == 50


def test_it_is_what_the_recipe_makes_now(session, skin):
    for source, camera in zip(session.cameras, make_cameras(4, (640, 480), 0), strict=True):
        assert np.allclose(source.camera.T_world_camera, camera.T_world_camera, atol=1e-9)
        assert np.allclose(source.camera.K, camera.K)
    (role,) = cast_of("elbow_rotation")
    poses = perform(role, skin.model, 50, 25.0)
    assert np.allclose(read_pose_table(SAMPLE / "truth.csv").values, poses, atol=1e-5)
    true = load_model(SAMPLE / "truth_model.toml")
    assert np.allclose([j.position for j in true.joints], [j.position for j in skin.model.joints])
    source = session.cameras[1]
    image, _ = film(see_room(source.camera, 0), freeze([skin], [poses[44]]))
    filmed = open_footage(source.footage, source.camera.name).read(44)
    # What is left is noise and compression.
    assert np.median(np.abs(filmed - 255.0 * image)) < 2.5
    assert np.percentile(np.abs(filmed - 255.0 * image), 99) < 12
