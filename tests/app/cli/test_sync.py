"""`quadrille sync` from end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import assert_refused, output_of

from tracker.errors import SessionError
from tracker.footage import sound, start_times
from tracker.session import footage_clocks, synchronize
from tracker.session.session import load_session, save_camera_files


def clocks(session):
    return {c.camera.name: (c.offset, round(c.clock.ahead_frames, 6)) for c in load_session(session).cameras}


@pytest.fixture
def heard(session, monkeypatch):
    """A session the last camera of which hears everything 10 ms later, and the second something else."""
    rng, rate = np.random.default_rng(0), sound.SoundSettings().rate
    samples = rng.normal(size=4 * rate).astype(np.float32)
    others = {c.camera.name: samples for c in load_session(session).cameras}
    first, second, *_, last = others
    others[second] = rng.normal(size=4 * rate).astype(np.float32)
    others[last] = np.concatenate([np.zeros(rate // 100, np.float32), samples])
    monkeypatch.setattr(synchronize, "read_sound", lambda path, name: others[name])
    return session, (first, second, last)


def test_offset_of_an_existing_session(run, session):
    name, fps = load_session(session).cameras[1].camera.name, load_session(session).fps
    status, out, _ = run("sync", session, "--offset", f"{name}=0.4", "--drift", f"{name}=0.00002", "--json")
    (row,) = [c for c in json.loads(out)["cameras"] if c["name"] == name]
    assert (status, row["offset"], row["time_rate"]) == (0, 0, 0.00002)
    assert row["time_offset_s"] == pytest.approx(-0.4 / fps)
    assert clocks(session)[name] == (0, -0.4)
    assert run("sync", session, "--offset", f"{name}=0", "--drift", f"{name}=0")[0] == 0
    assert "time_" not in (session / "session.toml").read_text()


def test_sound_writes_what_is_clear_only_when_asked(run, heard):
    session, (first, second, last) = heard
    before = (session / "session.toml").read_text()
    out = output_of(run("sync", session, "--sound"))
    assert f"{second}: offset" in out
    assert "not clear, so not taken" in out
    assert "nothing written" in out
    assert (session / "session.toml").read_text() == before
    status, _, error = run("sync", session, "--sound", "--apply")
    assert (status, error) == (0, "")
    offsets = clocks(session)
    assert offsets[first] == offsets[second] == (0, 0.0)
    offset, ahead = offsets[last]
    assert offset - ahead == pytest.approx(0.01 * load_session(session).fps, abs=0.01)


def test_wrong_input(run, session):
    assert_refused(run("sync", session), ["one of --sound, --flash, --timecode, or --offset"])
    assert_refused(run("sync", session, "--sound", "--offset", "x=1"), ["one of --sound, --flash"])
    assert_refused(run("sync", session, "--sound"), ["expected sound in the videos of two cameras", "found it in 0"])
    assert_refused(run("sync", session, "--offset", "nobody=1"), ["unknown camera 'nobody'"])
    name = load_session(session).cameras[0].camera.name
    assert_refused(run("sync", session, "--offset", f"{name}=nan"), ["--offset as NAME=VALUE"])
    assert_refused(run("sync", session, "--offset", f"{name}=5000.5"), [f"'{name}'", "an offset of at most 0"])
    assert_refused(run("sync", session, "--offset", f"{name}=-3"), ["give each of the others an offset of 3"])
    assert_refused(run("sync", session, "--drift", f"{name}=3"), ["a drift from -0.1 to 0.1"])


@pytest.fixture
def timed(session, monkeypatch):
    """A session whose videos have time codes: the second camera began 3 frames before the others."""
    codes = {c.camera.name: "10:00:00:12" for c in load_session(session).cameras}
    codes[list(codes)[1]] = "10:00:00:09"
    monkeypatch.setattr(
        footage_clocks, "read_start_times", lambda path, where: (time_code(codes[where.split("'")[1]]),)
    )
    return session, codes


def time_code(text):
    frames = start_times.time_code_frames(text, 25.0)
    return start_times.StartTime("time code", text, frames / 25, 1 / 25, 86_400)


def test_time_codes(run, timed):
    session, codes = timed
    name = list(codes)[1]
    out = output_of(run("sync", session, "--timecode"))
    assert f"{name}: offset 3.000 frames, clear" in out
    assert "note: the time code of all cameras pairs frames (" in out
    assert "nothing written; say --apply" in out
    assert_refused(run("sync", session, "--timecode", "--apply"), [f"'{name}'", "an offset of at most 0"])
    codes[name] = "10:00:09:00"
    assert_refused(run("sync", session, "--timecode"), ["by it the cameras have no frame in common"])


def test_sound_against_time_codes(run, heard, timed):
    _, (first, _, last) = heard
    session, codes = timed
    status, out, _ = run("sync", session, "--sound", "--json")
    assert (status, json.loads(out)["notes"]) == (0, [])
    codes[last] = "10:00:00:02"
    status, out, _ = run("sync", session, "--sound")
    assert "note: the sound and the time code disagree by up to" in out
    assert f"{first}=0" in out
    assert f"{last}=10 by the time code" in out


def test_videos_without_clock(run, session):
    assert_refused(run("sync", session, "--timecode"), ["expected a time code, a GPS time or a creation time"])
    assert_refused(run("sync", session, "--timecode", "--sound"), ["one of --sound, --flash, --timecode"])


@pytest.mark.parametrize("way", ["--sound", "--flash", "--timecode"])
def test_nothing_to_compare(run, session, way):
    loaded = load_session(session)
    name = loaded.cameras[0].camera.name
    save_camera_files(loaded, [replace(c, footage=session / "missing.mp4") for c in loaded.cameras])
    assert_refused(run("sync", session, way), [f"camera '{name}': its footage", "missing.mp4 is not there", "relink"])


def test_one_camera_has_nothing_to_be_compared_with(session):
    loaded = load_session(session)
    with pytest.raises(SessionError, match="expected two cameras or more, found one"):
        synchronize.require_footage(replace(loaded, cameras=loaded.cameras[:1]))


def test_a_static_scene_shows_nothing(run, session, monkeypatch):
    monkeypatch.setattr(synchronize, "find_flash", lambda recording, i, n_frames: None)
    status, out, _ = run("sync", session, "--flash", "--apply")
    assert (status, out.splitlines()[-1]) == (0, "nothing written: nothing that was found is clear")
