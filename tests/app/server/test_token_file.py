"""The token outlasts a restart, and only this user's private file is believed."""

import os
import time

import pytest

from app.server import access
from app.server.access import access_for, kept_token


def test_a_restart_on_loopback_has_the_same_token_and_others_a_new_one(tmp_path):
    folder = tmp_path / "state" / "quadrille"
    first = access_for("127.0.0.1", tokens=folder).token
    assert access_for("127.0.0.1", tokens=folder).token == first
    assert (folder / "token").stat().st_mode & 0o077 == 0
    assert folder.stat().st_mode & 0o077 == 0
    assert access_for("0.0.0.0", ["lab.example.org"], tokens=folder).token != first
    assert access_for("127.0.0.1", ["tunnel.example.org"], tokens=folder).token != first
    assert [p.name for p in folder.iterdir()] == ["token"]


def damage(path, how):
    if how == "readable by others":
        path.chmod(0o644)
    elif how == "old":
        os.utime(path, (time.time() - 8 * 86400,) * 2)
    elif how == "of tomorrow":
        os.utime(path, (time.time() + 86400,) * 2)
    elif how == "short":
        path.write_text("guess")
    elif how == "not a token":
        path.write_bytes(b"\xff" * 60)
    elif how == "a link":
        path.rename(path.with_name("elsewhere"))
        path.symlink_to(path.with_name("elsewhere"))
    elif how == "a pipe":
        path.unlink()
        os.mkfifo(path, 0o600)


@pytest.mark.parametrize(
    "how", ["readable by others", "old", "of tomorrow", "short", "not a token", "a link", "a pipe"]
)
def test_a_file_that_cannot_be_trusted_is_replaced(tmp_path, how):
    first = kept_token(tmp_path)
    damage(tmp_path / "token", how)
    second = kept_token(tmp_path)
    assert second != first
    assert len(second) >= 43
    assert kept_token(tmp_path) == second
    assert (tmp_path / "token").stat().st_mode & 0o077 == 0
    assert not (tmp_path / "token").is_symlink()


def test_without_a_writable_folder_a_token_holds_for_one_start(tmp_path, monkeypatch):
    def full(*_words, **_more):
        raise OSError("no space left on device")

    monkeypatch.setattr(access, "write_text_atomic", full)
    assert kept_token(tmp_path) != kept_token(tmp_path)
    assert list(tmp_path.iterdir()) == []
