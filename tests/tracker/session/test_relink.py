"""Moved footage gets its new place; other footage is refused, and nothing is written then."""

import shutil
import unicodedata
from contextlib import closing
from dataclasses import replace

import cv2
import numpy as np
import pytest
from clips import SIZE, encode
from unreadable_folders import refuse_folders

from tracker import files
from tracker.errors import RecordingError, Remedy, SessionError
from tracker.footage.camera_source import missing_files
from tracker.footage.proxy import FOLDER, Proxy
from tracker.footage.video import open_footage
from tracker.formats.anipose import write_calibration
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.session.assemble import NewSession, assemble
from tracker.session.matching import check_names
from tracker.session.relink import Places, _files_named, relink, require_files
from tracker.session.session import load_session

K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])


@pytest.fixture
def room(tmp_path):
    """A session in `s` whose footage, backgrounds and masks lie in `take1`."""
    take = tmp_path / "take1"
    (take / "empty").mkdir(parents=True)
    cameras = [Camera(n, SIZE, K, np.zeros(0), rigid.transform(t=np.array([i, 0.0, 1.0]))) for i, n in enumerate("ab")]
    write_calibration(take / "Calib.toml", cameras)
    for name in "ab":
        encode(take / f"{name}.mp4", n=9)
        cv2.imwrite(str(take / "empty" / f"{name}.png"), np.zeros((*SIZE[::-1], 3), np.uint8))
        (take / "masks" / name).mkdir(parents=True)
        cv2.imwrite(str(take / "masks" / name / "000002.png"), np.zeros(SIZE[::-1], np.uint8))
    videos, side = [take / "a.mp4", take / "b.mp4"], {"background": take / "empty", "masks": take / "masks"}
    assemble(NewSession(tmp_path / "s" / "s", calibration=take / "Calib.toml", videos=videos, fps=90.0, **side))
    return tmp_path


def loaded(room):
    return load_session(room / "s" / "s")


def moved(room, to="disk/take1"):
    (room / to).parent.mkdir(parents=True, exist_ok=True)
    shutil.move(room / "take1", room / to)
    return room / to


def refuse(room, kind, expected, places):
    before = (room / "s" / "s" / "session.toml").read_bytes()
    with pytest.raises(kind, match=expected):
        relink(loaded(room), places)
    assert (room / "s" / "s" / "session.toml").read_bytes() == before


def test_everything_is_found_by_a_search(room):
    require_files(loaded(room))
    moved(room)
    session = loaded(room)
    assert [(m.camera, m.kind) for m in missing_files(session.cameras)] == [
        (camera, kind) for camera in "ab" for kind in ("footage", "background", "masks")
    ]
    with pytest.raises(SessionError, match=r"'a': footage .*a\.mp4 and 5 more not found") as caught:
        require_files(session)
    assert caught.value.remedy == Remedy("relink", session=session.folder)
    session, found = relink(session, Places(search=[room / "disk"]))
    assert len(found) == 6
    again = loaded(room)
    for at in (session, again):
        assert missing_files(at.cameras) == ()
        assert at.cameras[1].footage == room / "disk" / "take1" / "b.mp4"
        assert at.cameras[1].masks == room / "disk" / "take1" / "masks" / "b"
        assert (at.fps, at.cameras[1].declared_fps) == (90.0, 30.0)
    assert relink(again, Places(search=[room / "disk"]))[1] == ()


def test_a_search_is_bounded_and_passes_over_what_nobody_may_read(room, monkeypatch):
    moved(room)
    (room / "disk" / "lost+found").mkdir()
    refuse_folders(monkeypatch, "lost+found")
    with monkeypatch.context() as patch:
        patch.setattr(files, "LIMITS", files.WalkLimits(entries=3))
        refuse(room, SessionError, "at most 3 files and folders in .*disk", Places(search=[room / "disk"]))
    assert len(relink(loaded(room), Places(search=[room / "disk"]))[1]) == 6


def test_of_equal_names_the_one_in_the_folder_of_the_same_name(room):
    take = moved(room)
    shutil.copytree(take, room / "disk" / "take2")
    session, _ = relink(loaded(room), Places(search=[room / "disk"]))
    assert {c.footage.parent.name for c in session.cameras} == {"take1"}


def test_equal_names_in_strange_folders_are_left_to_the_user(room):
    take = moved(room, "disk/x/one")
    shutil.copytree(take, room / "disk" / "x" / "two")
    refuse(room, SessionError, "'a': the footage may be .*(one|two)", Places(search=[room / "disk"]))
    session, _ = relink(loaded(room), Places(search=[room / "disk" / "x" / "two"]))
    assert missing_files(session.cameras) == ()


def test_a_longer_video_of_common_frames_is_found_again(room):
    take = room / "take1"
    encode(take / "b.mp4", n=12)
    videos = [take / "a.mp4", take / "b.mp4"]
    shutil.rmtree(room / "s" / "s")
    request = NewSession(room / "s" / "s", calibration=take / "Calib.toml", videos=videos, common_frames=True)
    assemble(request)
    take = moved(room)
    encode(room / "disk" / "b.mp4", n=9)
    refuse(
        room, RecordingError, "'b': expected 12 frames .* found 9", Places(camera_paths={"b": room / "disk" / "b.mp4"})
    )
    session, _ = relink(loaded(room), Places(search=[take]))
    assert missing_files(session.cameras) == ()


def test_other_footage_is_refused(room):
    take = moved(room)
    encode(take / "b.mp4", n=12)
    refuse(room, RecordingError, "'b': expected 9 frames as in the session, found 12", Places(search=[take]))
    encode(take / "b.mp4", n=9, rate=25)
    refuse(room, RecordingError, "'b': expected 30 frames per second .*found 25", Places(search=[take]))
    (take / "b.mp4").write_bytes(b"no video")
    refuse(room, RecordingError, "'b'.*cannot be read", Places(search=[take]))


def test_a_renamed_file_is_given(room):
    take = moved(room)
    (take / "b.mp4").rename(take / "other.mp4")
    session, _ = relink(loaded(room), Places(search=[take]))
    assert [(m.camera, m.kind) for m in missing_files(session.cameras)] == [("b", "footage")]
    refuse(room, SessionError, "unknown camera 'c'", Places(camera_paths={"c": take / "other.mp4"}))
    refuse(room, RecordingError, "'b'.*nowhere", Places(camera_paths={"b": take / "nowhere.mp4"}))
    both = {"a": take / "other.mp4", "b": take / "other.mp4"}
    refuse(room, SessionError, "'a' and 'b' would share", Places(camera_paths=both))
    session, found = relink(loaded(room), Places(camera_paths={"b": take / "other.mp4"}))
    assert (missing_files(session.cameras), len(found)) == ((), 1)


def test_side_files_are_given_by_folder(room):
    take = moved(room)
    session, _ = relink(
        loaded(room),
        Places(camera_paths={n: take / f"{n}.mp4" for n in "ab"}, background=take / "empty", masks=take / "masks"),
    )
    assert missing_files(session.cameras) == ()
    bare = replace(session, cameras=tuple(replace(c, masks=None) for c in session.cameras))
    masked, found = relink(bare, Places(masks=take / "masks"))
    assert [(f.camera, f.kind, f.old) for f in found] == [("a", "masks", None), ("b", "masks", None)]
    assert [c.masks for c in masked.cameras] == [take / "masks" / "a", take / "masks" / "b"]
    with pytest.raises(RecordingError, match="camera 'a': no masks in"):
        relink(bare, Places(masks=take / "empty"))
    bare = replace(session, cameras=tuple(replace(c, background=None) for c in session.cameras))
    with pytest.raises(SessionError, match=r"no camera of .* has a background to relink"):
        relink(bare, Places(background=take / "empty"))


def test_a_search_needs_a_folder(room):
    refuse(room, SessionError, "expected a folder to search", Places(search=[room / "none"]))


def test_a_proxy_follows_its_footage(room):
    session = loaded(room)
    footage = session.cameras[0].footage
    proxy = Proxy(session.folder / FOLDER, "a")
    with closing(open_footage(footage, "a")) as opened:
        list(proxy.make(footage, opened))
    take = moved(room)
    assert proxy.follow(take / "a.mp4")
    assert proxy.fits(take / "a.mp4")
    assert not proxy.follow(take / "b.mp4")
    assert not Proxy(session.folder / FOLDER, "b").follow(take / "b.mp4")


def test_names_are_searched_in_both_unicode_forms(tmp_path):
    composed, apart = (unicodedata.normalize(form, "Büro.mp4") for form in ("NFC", "NFD"))
    (tmp_path / apart).write_bytes(b"")
    assert _files_named({composed}, [tmp_path]) == {composed: [tmp_path / apart]}
    assert check_names([apart], [composed], "camera", "the cameras") == [composed]
