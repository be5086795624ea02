"""Find the imported files, and the camera that each is of, by the names of files and folders."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tracker.errors import FormatError, Remedy
from tracker.formats.keypoints.openpose import numbered_name
from tracker.validation import same_form


@dataclass(frozen=True)
class FileGroup:
    """Files of one camera, or one file of points in space."""

    files: tuple[Path, ...]
    """In the order of their pictures."""
    labels: tuple[str, ...]
    """Names after which the camera may be called, best first."""
    root: Path
    """Folder to which the paths of the stored files are relative."""

    @property
    def place(self) -> Path:
        """The file, or the folder of the files, for messages."""
        return self.files[0] if len(self.files) == 1 else self.files[0].parent


def list_files(paths: Sequence[Path], suffixes: Sequence[str]) -> list[tuple[Path, Path]]:
    """Return the files of some suffixes among paths and in their folders, each with the folder it is relative to.

    Raises:
        FormatError: a path is missing, or there is no such file.
    """
    found: list[tuple[Path, Path]] = []
    for path in paths:
        if path.is_dir():
            found += [
                (p, path)
                for p in sorted(path.rglob("*"))
                if p.suffix.lower() in suffixes and not p.name.startswith(".")
            ]
        elif path.exists():
            found.append((path, path.parent))
        else:
            raise FormatError(f"expected a file or folder of observations, found none at {path}; check the path")
    if not found:
        raise FormatError(
            f"expected files that end in {', '.join(suffixes)}, found none in {', '.join(map(str, paths))}; "
            "check the folder"
        )
    return found


def numbered_groups(files: Sequence[tuple[Path, Path]]) -> list[FileGroup]:
    """Group files with one picture each, by their folder and by the name before the number.

    Raises:
        FormatError: a name has no number, or two of a group have the same.
    """
    groups: dict[tuple[Path, str], dict[int, tuple[Path, Path]]] = {}
    for path, root in files:
        named = numbered_name(path.name)
        if named is None:
            raise FormatError(
                f"expected the number of the picture in the file's name, as in CAMERA_000000000000_keypoints.json, "
                f"found {path.name}; rename it or leave it out"
            )
        stem, number = named
        group = groups.setdefault((path.parent, stem), {})
        if number in group:
            raise FormatError(
                f"expected one file for each picture, found {group[number][0].name} and {path.name}; leave one out"
            )
        group[number] = (path, root)
    out = []
    for (folder, stem), group in groups.items():
        ordered = [group[n] for n in sorted(group)]
        root = ordered[0][1]
        folders = [p.name for p in (folder, *folder.parents) if p.is_relative_to(root) and (p != root or not stem)]
        out.append(FileGroup(tuple(p for p, _ in ordered), (stem, *folders, root.name), root))
    return out


def match_cameras(
    labels: Sequence[tuple[tuple[str, ...], Path]], cameras: Sequence[str], chosen: Mapping[str, Path]
) -> list[str]:
    """Return the camera of each group of files; empty for one that cannot be matched.

    Args:
        labels: names after which the camera may be called, best first, and the place of the files.
        cameras: of the session.
        chosen: folder or file by camera, by the user's choice.

    Raises:
        FormatError: two groups are of one camera, or a choice is not among the files.
    """
    places = [place for _, place in labels]
    by_choice = {i: name for name, path in chosen.items() for i, place in enumerate(places) if _lies_at(place, path)}
    for name, path in chosen.items():
        if name not in by_choice.values():
            raise FormatError(f"expected {path}, chosen for camera '{name}', among the files, found none there")
    free = [name for name in cameras if name not in chosen]
    found = [by_choice.get(i) or _camera_of(names, free) for i, (names, _) in enumerate(labels)]
    for name in dict.fromkeys(n for n in found if n):
        if found.count(name) > 1:
            both = [str(places[i]) for i, n in enumerate(found) if n == name]
            raise FormatError(
                f"expected one file or folder for camera '{name}', found {' and '.join(both[:2])}",
                Remedy("name_observed_camera", camera=name),
            )
    return found


def _lies_at(place: Path, path: Path) -> bool:
    place, path = place.resolve(), path.resolve()
    return place == path or path in place.parents


def _camera_of(labels: Sequence[str], cameras: Sequence[str]) -> str:
    """Return the camera that a label names: exactly, or as a word in it, the longest name first; empty if none does."""
    for label in map(same_form, labels):
        exact = [name for name in cameras if same_form(name).casefold() == label.casefold()]
        if exact:
            return exact[0]
        words = [n for n in cameras if re.search(rf"(?<![^\W_]){re.escape(same_form(n))}(?=DLC|\b|_)", label, re.I)]
        longest = sorted(words, key=len)[-1:]
        if longest and all(n in longest[0] for n in words):
            return longest[0]
    return ""
