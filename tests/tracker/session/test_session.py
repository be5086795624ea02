import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from clips import SIZE, encode

from tracker.errors import CalibrationError, ModelError, Remedy, SessionError
from tracker.footage.camera_source import CameraSource, Clock, LostFrames
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.session.session import Person, create_session, load_session, save_floor, save_model, save_session

K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])


def camera(name, x=0.0):
    return Camera(name, SIZE, K, np.full(5, 0.01), rigid.transform(t=np.array([x, 0.0, 1.0])))


def people(*names):
    return [Person(n, load_model("gavrila22", 1.62), "#112233") for n in names]


@pytest.fixture
def cameras(tmp_path):
    """One camera's footage in the session, one's beside it."""
    return [
        CameraSource(camera("front"), tmp_path / "s" / "front.mp4", tmp_path / "bg" / "front.png"),
        CameraSource(camera("left", 2.0), tmp_path / "videos" / "left", masks=tmp_path / "masks", offset=3),
    ]


def make(tmp_path, sources, **changes):
    return create_session(
        tmp_path / "s", **({"cameras": sources, "people": people("ann"), "fps": 50.0, "n_frames": 9} | changes)
    )


def assert_same(a, b):
    assert (a.folder, a.name, a.fps, a.n_frames, a.up) == (b.folder, b.name, b.fps, b.n_frames, b.up)
    for x, y in zip(a.cameras, b.cameras, strict=True):
        assert (x.footage, x.background, x.masks, x.offset) == (y.footage, y.background, y.masks, y.offset)
        assert (x.camera.name, x.camera.size) == (y.camera.name, y.camera.size)
        np.testing.assert_allclose(x.camera.T_world_camera, y.camera.T_world_camera, atol=1e-12)
    for p, q in zip(a.people, b.people, strict=True):
        assert (p.name, p.color, p.model.height_m) == (q.name, q.color, q.model.height_m)
        assert p.model.value_names == q.model.value_names


def test_round_trip(tmp_path, cameras):
    session = make(tmp_path, cameras, people=people("ann", "bob"), name="A title", up="-y")
    assert_same(load_session(tmp_path / "s"), session)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s"]


def test_people_whose_names_file_systems_take_for_one_have_bodies_of_their_own(tmp_path, cameras):
    bodies = [Person(n, load_model("gavrila22", h), "#112233") for n, h in (("Ann", 1.5), ("ann", 1.6), ("con", 1.7))]
    session = save_model(make(tmp_path, cameras, people=bodies), 0, load_model("gavrila22", 1.8))
    files = sorted(p.stem for p in (tmp_path / "s" / "models").iterdir())
    assert len({stem.casefold() for stem in files}) == 3
    assert "con" not in files
    assert [p.model.height_m for p in load_session(session.folder).people] == [1.8, 1.6, 1.7]


def test_a_body_that_lies_elsewhere_stays_that_of_the_person(tmp_path, cameras):
    session = make(tmp_path, cameras)
    (tmp_path / "s" / "models" / "ann.toml").rename(tmp_path / "s" / "body.toml")
    text = (tmp_path / "s" / "session.toml").read_text()
    (tmp_path / "s" / "session.toml").write_text(text.replace("models/ann.toml", "body.toml"))
    save_floor(load_session(session.folder), "y", None)
    assert_same(load_session(session.folder), replace(session, up="y"))


def test_defaults(tmp_path, cameras):
    session = make(tmp_path, cameras)
    assert (session.name, session.up) == ("s", "z")


def test_saved_again(tmp_path, cameras):
    session = make(tmp_path, cameras)
    save_session(session)
    assert_same(load_session(tmp_path / "s"), session)


def test_session_moves_with_what_lies_beside_it(tmp_path, cameras):
    make(tmp_path, cameras)
    (tmp_path / "elsewhere").mkdir()
    shutil.move(tmp_path / "s", tmp_path / "elsewhere" / "t")
    front, left = load_session(tmp_path / "elsewhere" / "t").cameras
    assert front.footage == tmp_path / "elsewhere" / "t" / "front.mp4"
    assert left.footage == tmp_path / "elsewhere" / "videos" / "left"


def test_footage_far_away_keeps_its_path(tmp_path, cameras):
    create_session(tmp_path / "deep" / "s", cameras=cameras, people=people("ann"), fps=30, n_frames=3)
    shutil.move(tmp_path / "deep" / "s", tmp_path / "s")
    assert load_session(tmp_path / "s").cameras[1].footage == tmp_path / "videos" / "left"


def test_relative_paths_are_those_of_now(tmp_path, cameras, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = CameraSource(camera("front"), tmp_path.relative_to(tmp_path) / "videos" / ".." / "front.mp4")
    create_session("s", cameras=[source], people=people("ann"), fps=30, n_frames=3)
    monkeypatch.chdir("/")
    assert load_session(tmp_path / "s").cameras[0].footage == tmp_path / "front.mp4"


def test_length_is_counted_where_it_is_not_given(tmp_path):
    sources = [
        CameraSource(camera("a"), encode(tmp_path / "a.mp4", n=8)),
        CameraSource(camera("b"), encode(tmp_path / "b.mp4", n=9), offset=2),
    ]
    assert make(tmp_path, sources, n_frames=None).n_frames == 7


def test_empty_folder_is_filled(tmp_path, cameras):
    (tmp_path / "s").mkdir()
    make(tmp_path, cameras)
    load_session(tmp_path / "s")


def test_folder_in_use_is_left_alone(tmp_path, cameras):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "thesis.txt").write_text("precious")
    with pytest.raises(SessionError, match="exists already"):
        make(tmp_path, cameras)
    assert [p.name for p in (tmp_path / "s").iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"people": []}, "at least one person"),
        ({"cameras": []}, "at least one camera"),
        ({"people": people("ann", "ann")}, "a name of its own for each person, found more than one 'ann'"),
        ({"people": people("../ann")}, r"letters, digits.* as 'people\[0\].name', found '../ann'"),
        ({"people": people("")}, "a person's name of at most 100 letters, digits.*found ''"),
        ({"up": "w"}, "x, -x, y, -y, z, -z, as 'up', found 'w'"),
        ({"fps": 0.0}, "above 0"),
        ({"fps": float("nan")}, "above 0"),
        ({"fps": float("inf")}, "a frame rate above 0"),
        ({"n_frames": 10**30}, "a whole number of frames from 1"),
        ({"n_frames": -3}, "check the footage and the offsets"),
    ],
)
def test_refused_before_anything_is_written(tmp_path, cameras, changes, expected):
    with pytest.raises(SessionError, match=expected):
        make(tmp_path, cameras, **changes)
    assert list(tmp_path.iterdir()) == []


def test_negative_offset_says_what_to_do(tmp_path, cameras):
    early = CameraSource(camera("right"), tmp_path / "r.mp4", offset=-4)
    with pytest.raises(SessionError, match="others an offset of 4"):
        make(tmp_path, [*cameras, early])


def test_clocks_below_a_frame_are_kept(tmp_path, cameras):
    front, left = cameras
    clocked = [front.starting_at(1.4), replace(left, clock=Clock(0.25, 2e-5))]
    make(tmp_path, clocked)
    text = (tmp_path / "s" / "session.toml").read_text()
    assert all(row in text for row in ("version = 5", "time_offset_s = -0.008", "time_rate = 2e-05"))
    read = load_session(tmp_path / "s")
    assert [(c.offset, c.clock) for c in read.cameras] == [(1, Clock(-0.4)), (3, Clock(0.25, 2e-5))]
    save_session(read)
    assert (tmp_path / "s" / "session.toml").read_text() == text


def test_lost_frames_are_kept(tmp_path, cameras):
    lost = (LostFrames(30, 1), LostFrames(45, -2))
    make(tmp_path, [replace(cameras[0], clock=Clock(0.0, 0.0, lost)), *cameras[1:]])
    text = (tmp_path / "s" / "session.toml").read_text()
    assert "version = 6" in text
    read = load_session(tmp_path / "s")
    assert read.cameras[0].clock.lost == lost
    save_session(read)
    assert (tmp_path / "s" / "session.toml").read_text() == text


def test_without_clocks_none_are_written(tmp_path, cameras):
    make(tmp_path, cameras)
    text = (tmp_path / "s" / "session.toml").read_text()
    assert "time_" not in text
    assert "version = 1" in text


@pytest.mark.parametrize(("start", "offset", "ahead"), [(2.4, 2, -0.4), (2.75, 3, 0.25), (-0.8, 0, 0.8), (5, 5, 0.0)])
def test_start_is_split_into_the_nearest_frame_and_the_rest(cameras, start, offset, ahead):
    source = cameras[0].starting_at(start)
    assert (source.offset, source.clock.ahead_frames) == (offset, ahead)
    assert source.start_frames == pytest.approx(start, abs=1e-12)


def test_nothing_half_written_when_writing_fails(tmp_path, cameras, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tracker.session.session.format_model", full)
    with pytest.raises(SessionError, match="No space left"):
        make(tmp_path, cameras)
    assert list(tmp_path.iterdir()) == []


def edit(folder, old, new):
    path = folder / "session.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("version = 1", "version = 7", "version 7, this program reads up to 6; upgrade"),
        ("version = 1", "version = 'x'", "'version': expected a whole number, found 'x'"),
        ("fps = 50.0", "", "expected the key 'fps', found none"),
        ("fps = 50.0", "fps = 'fast'", "a frame rate above 0.* as 'fps', found 'fast'"),
        ("fps = 50.0", "fps = 50.0\nshutter = 3", "only version, name, .* as keys, found 'shutter'"),
        ("offset = 3", "offset = 3, shutter = 3", r"as keys in 'cameras\[left\]', found 'shutter'"),
        ("color =", "colour =", r"only name, model, color as keys in 'people\[ann\]', found 'colour'"),
        ('name = "left"', 'name = "right"', "left, right"),
        ("fps = 50.0", "fps = = 50.0", "line 3"),
        ("n_frames = 9", "n_frames = 0", "a whole number of frames from 1"),
        ("n_frames = 9", "n_frames = inf", "a whole number of frames from 1 .* as 'n_frames', found inf"),
        ("n_frames = 9", "n_frames = 9.5", "as 'n_frames', found 9.5"),
        ("n_frames = 9", "n_frames = 1000000000000", "as 'n_frames', found 1000000000000"),
        ("fps = 50.0", "fps = nan", "as 'fps', found nan"),
        ("offset = 3", "offset = inf", r"as 'cameras\[left\].offset', found inf"),
        ("offset = 3", "offset = -4", "others an offset of 4"),
        ("offset = 3", "offset = 3, lost_frames = [[30, 1], [20, 1]]", r"'cameras\[left\]', found frames 30, 20"),
        ("offset = 3", "offset = 3, lost_frames = [[30, 1], [30, 1]]", "a later frame in each row.*frames 30, 30"),
        ("offset = 3", "offset = 3, lost_frames = [[0, 1]]", "a frame from 1 on"),
        ("offset = 3", "offset = 3, lost_frames = [[30, 0.5]]", "a whole number of frames"),
        ("offset = 3", "offset = 3, time_offset_s = 7.0", "a time from -1 to 1 s"),
        ("offset = 3", "offset = 3, time_rate = 7.0", "a drift"),
        ("#112233", "red", r"a colour such as #f2a33a as 'people\[ann\].color', found 'red'"),
        ("videos/left", "videos\\u0000left", r"as 'cameras\[left\].footage'"),
        ('calibration = "calibration.toml"', "calibration = 3", "path of a file or folder as 'calibration', found 3"),
        ("version = 1", "version = " + "[" * 9999, "at most 32 levels of nesting"),
        ("version = 1", "version = " + "9" * 9999, "not valid TOML"),
        ("version = 1", "version = 0x" + "f" * 9999, "has version a number of thousands of digits"),
        ("n_frames = 9", "n_frames = 9\nfloor = {normal = [0, 0, 0], offset_m = 1}", "three numbers"),
        ("n_frames = 9", "n_frames = 9\nfloor = {normal = [0, 1], offset_m = 1}", "3 finite numbers as 'floor.normal'"),
        ("n_frames = 9", "n_frames = 9\nfloor = {normal = [0, 0, 1], offset_m = nan}", "floor.offset_m', found nan"),
        ("n_frames = 9", "n_frames = 9\nfloor = {normal = [0, 0, 1]}", "offset_m"),
        ("n_frames = 9", "n_frames = 9\nfloor = {normal = [0, 0, 1], offset_m = 1, tilt = 3}", "tilt"),
        ("n_frames = 9", "n_frames = 9\nfloor = 3", "a group of keys.* as 'floor', found 3"),
    ],
)
def test_malformed_session_file(tmp_path, cameras, old, new, expected):
    make(tmp_path, cameras)
    edit(tmp_path / "s", old, new)
    with pytest.raises(SessionError, match=expected):
        load_session(tmp_path / "s")


def test_missing_parts(tmp_path, cameras):
    make(tmp_path, cameras)
    (tmp_path / "s" / "models" / "ann.toml").unlink()
    with pytest.raises(ModelError, match="not found"):
        load_session(tmp_path / "s")
    (tmp_path / "s" / "calibration.toml").unlink()
    with pytest.raises(CalibrationError, match="not found"):
        load_session(tmp_path / "s")


def test_no_session(tmp_path):
    with pytest.raises(SessionError, match="is not a session") as caught:
        load_session(tmp_path)
    assert caught.value.remedy == Remedy("make_session")


def test_a_session_has_an_identity_from_its_making_on(tmp_path, cameras):
    make(tmp_path, cameras)
    shutil.copytree(tmp_path / "s", tmp_path / "copy")
    one, copy = load_session(tmp_path / "s"), load_session(tmp_path / "copy")
    assert one.uid == copy.uid
    assert re.fullmatch("[0-9a-f]{32}", one.uid)
    save_session(one)
    assert load_session(tmp_path / "s").uid == copy.uid
    (tmp_path / "s" / "identity.txt").unlink()
    assert load_session(tmp_path / "s").uid == "", "as those of older programs"
    (tmp_path / "s" / "identity.txt").write_text("other text")
    with pytest.raises(SessionError, match=r"identity\.txt: expected 32 hexadecimal digits, found 'other text'"):
        load_session(tmp_path / "s")
