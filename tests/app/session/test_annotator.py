import os

import pytest

from app.session.annotator import annotator_or_login, set_annotator
from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.annotator import VARIABLE, annotator


@pytest.fixture(autouse=True)
def nobody(tmp_path, monkeypatch):
    """An account on which nobody has been named."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.setattr("getpass.getuser", lambda: "login")


def test_without_a_name_the_page_takes_the_login_and_programs_none():
    set_annotator(None)
    assert (annotator(), annotator_or_login()) == ("", "login")


def test_a_name_is_remembered_for_later_commands(monkeypatch):
    set_annotator("anna")
    assert os.environ[VARIABLE] == "anna"  # for the programs that this one starts
    monkeypatch.setenv(VARIABLE, "")
    set_annotator(None)
    assert (annotator(), annotator_or_login()) == ("anna", "anna")


def test_the_variable_counts_before_the_name_that_is_remembered(monkeypatch):
    set_annotator("anna")
    monkeypatch.setenv(VARIABLE, "ben")
    set_annotator(None)
    assert annotator_or_login() == "ben"


@pytest.mark.parametrize("name", ["two\nlines", "x" * 201])
def test_a_name_that_is_none_is_refused_and_not_remembered(name):
    with pytest.raises(TrackerError, match="expected the annotator as a name of 1 to 200 characters"):
        set_annotator(name)
    assert annotator() == ""


def test_edits_of_commands_carry_the_name(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "ben")
    store = AnnotationStore(tmp_path / "annotations.sqlite")
    store.commit("track", [])
    store.commit("Drag", [], author="anna")
    assert [entry.author for entry in store.history()] == ["anna", "ben"]
