"""Nothing is written through symbolic links inside a session: they may lead anywhere."""

import shutil
from pathlib import Path

import pytest

from tracker.errors import SessionError
from tracker.session.lock import SessionLock
from tracker.session.session import load_session, save_floor, save_model, save_session

SAMPLE = Path(__file__).resolve().parents[3] / "sample_sessions" / "elbow_rotation"
WRITES = {
    "lock.json": lambda s: SessionLock(s.folder).acquire(),
    "session.toml": lambda s: save_floor(s, s.up, s.floor),
    "models": lambda s: save_model(s, 0, s.people[0].model),
    "models/person.toml": lambda s: save_model(s, 0, s.people[0].model),
    "calibration.toml": save_session,
}


@pytest.mark.parametrize("name", WRITES)
@pytest.mark.parametrize("dangling", [False, True])
def test_a_link_is_refused_and_what_it_leads_to_stays(tmp_path, name, dangling):
    folder = Path(shutil.copytree(SAMPLE, tmp_path / "session"))
    session = load_session(folder)
    link, target = folder / name, tmp_path / "target"
    if link.exists():
        link.rename(target)
    elif not dangling:
        target.write_text("{}")
    if dangling and target.exists():
        shutil.rmtree(target) if target.is_dir() else target.unlink()
    link.symlink_to(target)
    files = {p: p.read_bytes() for p in tmp_path.glob("target/**/*") if p.is_file()}
    before = target.read_bytes() if target.is_file() else files
    with pytest.raises(SessionError, match=f"{name} is a symbolic link, and nothing is written through links"):
        WRITES[name](session)
    assert link.is_symlink()
    assert (target.read_bytes() if target.is_file() else files) == before
    assert target.exists() != dangling


def test_a_session_may_be_reached_through_a_link(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "session")
    (tmp_path / "link").symlink_to(tmp_path / "session")
    session = load_session(tmp_path / "link")
    with SessionLock(session.folder):
        save_model(session, 0, session.people[0].model)
