"""Walks through folders that a user names."""

import pytest
from unreadable_folders import refuse_folders

from tracker import files
from tracker.errors import FormatError
from tracker.files import WalkLimits, entries_below, paths_in


def below(folder, **options):
    return sorted(e.path.removeprefix(f"{folder}/") for e in entries_below(folder, FormatError, **options))


@pytest.fixture
def folder(tmp_path):
    """Folders within each other, with a link that leads back to the first."""
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    (inner / "x.json").touch()
    (tmp_path / "a" / "y.json").touch()
    (inner / "back").symlink_to(tmp_path, target_is_directory=True)
    return tmp_path


def test_links_to_folders_are_listed_and_not_followed(folder):
    assert below(folder) == ["a", "a/b", "a/b/back", "a/b/x.json", "a/y.json"]
    assert below(folder / "a" / "b" / "back", enters=False) == ["a"], "the folder itself may be a link"


@pytest.mark.parametrize(
    ("limits", "match"),
    [
        (WalkLimits(entries=4), "at most 4 files and folders in .*, found more after 4; name"),
        (WalkLimits(seconds=-1), "within -1 s"),
        (WalkLimits(depth=2), "at most 2 folders within each other, found more at .*/a/b; name"),
    ],
)
def test_a_walk_ends_at_each_bound(folder, monkeypatch, limits, match):
    monkeypatch.setattr(files, "LIMITS", WalkLimits(5, 3))
    assert len(below(folder)) == 5
    monkeypatch.setattr(files, "LIMITS", limits)
    with pytest.raises(FormatError, match=match):
        below(folder)


def test_a_folder_that_cannot_be_read_is_named_or_passed_over(folder, monkeypatch):
    refuse_folders(monkeypatch, "/b")
    with pytest.raises(FormatError, match=r"/a/b cannot be \(Permission denied\)"):
        below(folder)
    assert below(folder, passes_unreadable=True) == ["a", "a/b", "a/y.json"]
    with pytest.raises(FormatError, match="Permission denied"):
        below(folder / "a" / "b", passes_unreadable=True)


@pytest.mark.parametrize("name", ["missing", "a/y.json", "a\0b"])
def test_a_file_in_place_of_a_folder_is_refused(folder, name):
    with pytest.raises(FormatError, match="expected a folder that can be read"):
        paths_in(folder / name, FormatError)


def test_hidden_and_unwanted_names_are_left_out(folder):
    (folder / ".hidden.json").touch()
    assert paths_in(folder / "a", FormatError, lambda name: name.endswith(".json")) == [folder / "a" / "y.json"]
    assert paths_in(folder, FormatError) == [folder / "a"]
