"""Find the imported files, and the camera that each is of, by the names of files and folders."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import TypeAlias

from tracker.errors import FormatError, Remedy
from tracker.files import entries_below
from tracker.formats.keypoints.picture_names import PictureName, picture_names
from tracker.interchange.observations.observed import SourceFile, checksum
from tracker.session.matching import check_names
from tracker.validation import nfc_name

Found: TypeAlias = tuple[Path, Path]
"""A file, and the folder that the path of its stored copy is relative to."""


@dataclass(frozen=True)
class FileGroup:
    """Files of one camera, or one file of points in space."""

    files: tuple[Path, ...]
    """In the order of their pictures."""
    labels: tuple[str, ...]
    """Names after which the camera may be called, best first."""
    root: Path
    """Folder to which the paths of the stored files are relative."""
    pictures: tuple[PictureName, ...] = ()
    """For files with one picture each: the label and number of each, ascending by number. Several may have a number."""
    video: Path | None = None
    """Video that the points are of, as a file names it that may be of several; None for other files."""

    @property
    def numbers(self) -> list[int]:
        """Numbers of the pictures, each once, ascending."""
        return sorted({picture.number for picture in self.pictures})

    @property
    def place(self) -> Path:
        """The file, or the folder of the files, for messages."""
        return self.files[0] if len(self.files) == 1 else self.files[0].parent


def list_files(paths: Sequence[Path], suffixes: Sequence[str]) -> list[Found]:
    """Return the files of some suffixes among paths and in their folders, each with the folder it is relative to.

    Raises:
        FormatError: a path is missing, a folder is too large, or there is no such file.
    """
    found: list[Found] = []
    for path in paths:
        if path.is_dir():
            named = (e for e in entries_below(path, FormatError) if not e.name.startswith("."))
            inside = (Path(e.path) for e in named if e.name.lower().endswith(tuple(suffixes)) and e.is_file())
            found += [(file, path) for file in sorted(inside)]
        elif path.exists():
            found.append((path, path.parent))
        else:
            raise FormatError(f"expected a file or folder of observations, found none at {path}; check the path")
    if not found:
        expected = f"files that end in {', '.join(suffixes)}"
        raise FormatError.mismatch("", expected, f"none in {', '.join(map(str, paths))}", "check the folder")
    return found


def folder_labels(path: Path, root: Path) -> tuple[str, ...]:
    """Return the names after which the camera of a file may be called: its stem, and its folders from within."""
    folders = [p.name for p in path.parents if p == root or p.is_relative_to(root)]
    return (path.stem, *folders)


def numbered_groups(files: Sequence[Found], cameras: Sequence[str]) -> list[FileGroup]:
    """Group files with one picture each by their folder, and by the camera in their names or else the rest of them.

    Raises:
        FormatError: a name has no number, or two that differ in nothing else have the same.
    """
    folders: dict[Path, list[Found]] = {}
    for path, root in files:
        folders.setdefault(path.parent, []).append((path, root))
    groups: dict[tuple[Path, str], dict[PictureName, Found]] = {}
    for some in folders.values():
        names = picture_names([path.stem.removesuffix("_keypoints") for path, _ in some])
        for (path, root), name in zip(some, names, strict=True):
            if name is None:
                expected = "the number of the picture in the file's name, as in CAMERA_000000000012_keypoints.json"
                raise FormatError.mismatch("", expected, path.name, "rename it or leave it out")
            folder = path.parent
            if _is_object(folder, cameras):
                folder, name = folder.parent, PictureName(f"{folder.name} {name.label}".strip(), name.number)
            camera = _camera_of(_picture_labels([name], path, root, cameras), cameras)
            group = groups.setdefault((folder, camera or name.label), {})
            if name in group:
                found = f"{group[name][0].name} and {path.name}"
                raise FormatError.mismatch("", "one file for each picture", found, "leave one out")
            group[name] = (path, root)
    out = []
    for group in groups.values():
        pictures = tuple(sorted(group, key=lambda picture: (picture.number, picture.label)))
        first, root = group[pictures[0]]
        labels = _picture_labels(pictures, first, root, cameras)
        out.append(FileGroup(tuple(group[p][0] for p in pictures), labels, root, pictures))
    return out


def _is_object(folder: Path, cameras: Sequence[str]) -> bool:
    """Return whether a folder in that of a camera is named after an object, as `001` or `obj_2` of SAM 2."""
    is_numbered = re.fullmatch(r"(?:obj(?:ect)?(?:_?id)?[_-]?)?[0-9]+", folder.name, re.I) is not None
    return is_numbered and not _camera_of((folder.name,), cameras) and bool(_camera_of((folder.parent.name,), cameras))


def _picture_labels(pictures: Sequence[PictureName], path: Path, root: Path, cameras: Sequence[str]) -> tuple[str, ...]:
    """Return the names after which the camera of pictures in a folder may be called, best first.

    A label without letters may be the number of an object: the folder of a camera comes first.
    """
    own, folders = dict.fromkeys(p.label for p in pictures), folder_labels(path, root)[1:]
    has_letters = any(character.isalpha() for label in own for character in label)
    return (*own, *folders) if has_letters or not {*folders[:1]} & {*cameras} else (*folders, *own)


def videos_of_footage(groups: Sequence[FileGroup], footage: Mapping[str, Path]) -> list[bool]:
    """Return whether each group is of the session, where a file holds the videos of several.

    Of several videos of one camera it is the one whose path is most like that of the footage from its end on.

    Args:
        groups: files, perhaps with their videos.
        footage: of each camera.
    """
    names = [_camera_of(group.labels, [*footage]) if group.video else "" for group in groups]
    out = [True] * len(groups)
    for camera, path in footage.items():
        likeness = {i: _common_end(groups[i].video or path, path) for i, name in enumerate(names) if name == camera}
        most = max(likeness.values(), default=0)
        if list(likeness.values()).count(most) == 1:
            for i, n in likeness.items():
                out[i] = n == most
    return out


def _common_end(one: Path, other: Path) -> int:
    """Return how many parts two paths have in common from their ends on; the suffix may differ."""
    ends = [[path.stem, *(p.name for p in path.parents)] for path in (one, other)]
    return len([*takewhile(lambda pair: pair[0].casefold() == pair[1].casefold(), zip(*ends, strict=False))])


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
    check_names(chosen, cameras, "camera", "the files by camera")
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
            if len(set(both)) < len(both):
                expected = f"the pictures of camera '{name}' once"
                seen = "those of several videos of its name"
                raise FormatError.mismatch(both[0], expected, seen, "export those of this session alone")
            wanted = f"one file or folder for camera '{name}'"
            raise FormatError.mismatch("", wanted, " and ".join(both[:2]), Remedy("name_observed_camera", camera=name))
    return found


def no_camera(cameras: Sequence[str], group: FileGroup) -> FormatError:
    """Return that files are named after none of the cameras of the session."""
    expected = f"the name of a camera ({', '.join(cameras)}) in {group.place}"
    found = ", ".join(dict.fromkeys(filter(None, group.labels)))
    return FormatError.mismatch("", expected, found, Remedy("name_observed_camera", camera=cameras[0]))


def source_files(groups: Sequence[tuple[FileGroup, str]]) -> tuple[tuple[SourceFile, ...], dict[str, Path]]:
    """Return the files with their checksums, and the file of each path.

    Raises:
        FormatError: a file cannot be read, or two would have one path.
    """
    sources: dict[str, SourceFile] = {}
    by_path: dict[str, Path] = {}
    for group, camera in groups:
        inside = {file: file.relative_to(group.root).as_posix() for file in group.files}
        if any(by_path.get(path, file) != file for file, path in inside.items()):  # files of a folder stay together
            inside = {file: f"{file.parent.name}/{path}" for file, path in inside.items()}
        for file, path in inside.items():
            if by_path.get(path, file) != file:
                raise FormatError(f"expected files of different names, found two named {path}; rename one")
            try:
                found = SourceFile(path, checksum(file.read_bytes()), camera)
            except OSError as error:
                raise FormatError(f"{file} cannot be read: {error}; check that you may read it") from error
            sources[path] = SourceFile(path, found.sha256, "") if path in sources else found
            by_path[path] = file
    return tuple(sources.values()), by_path


def _lies_at(place: Path, path: Path) -> bool:
    place, path = place.resolve(), path.resolve()
    return place == path or path in place.parents


def _camera_of(labels: Sequence[str], cameras: Sequence[str]) -> str:
    """Return the camera that a label names: exactly, or as a word in it, the longest name first; empty if none does."""
    for label in map(nfc_name, labels):
        exact = [name for name in cameras if nfc_name(name).casefold() == label.casefold()]
        if exact:
            return exact[0]
        words = [n for n in cameras if re.search(rf"(?<![^\W_]){re.escape(nfc_name(n))}(?=DLC|\b|_)", label, re.I)]
        longest = sorted(words, key=len)[-1:]
        if longest and all(n in longest[0] for n in words):
            return longest[0]
    return ""
