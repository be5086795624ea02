"""Read calibrated cameras from files of any layout of the table; others are named, with a way to convert them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path

import numpy as np

from tracker.errors import CalibrationError, Remedy
from tracker.files import paths_in
from tracker.formats.anipose import METRES, CameraEntry, Units, check_names, read_entry
from tracker.formats.calibrations import pose_conventions
from tracker.formats.calibrations.calibration_layout import CalibrationLayout
from tracker.formats.calibrations.camera_matrices import is_transposed
from tracker.formats.calibrations.camera_words import Section, is_absent, plain_text
from tracker.formats.calibrations.convention_names import CONVENTIONS, PoseConvention
from tracker.formats.calibrations.data_layouts import board_square
from tracker.formats.calibrations.document import (
    Document,
    foreign,
    name_binary,
    named,
    read_document,
    refuse,
    refuse_program,
)
from tracker.formats.calibrations.layouts import find_layout
from tracker.formats.calibrations.units import check_focal_lengths, check_units
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import nfc_name, quoted

_SUFFIXES = (".toml", ".json", ".yml", ".yaml", ".xml", ".xcp", ".txt", ".csv", ".calibration")
"""Files of a folder that may hold a calibration; the others are not opened."""
_CORRECT_POSE = "correct its pose, or remove the camera"
_MAX_FILES = 1000
"""Most files of a folder that are looked at, which bounds time."""


@dataclass(frozen=True, eq=False)
class CalibratedCameras:
    """The cameras of a calibration."""

    entries: tuple[CameraEntry, ...]
    """Cameras with lens and pose, in the order of the file."""
    left_out: dict[str, str]
    """Why other cameras of the file are left out, by their names: `has no pose`."""
    notes: tuple[str, ...]
    """Sentences for the user: cameras left out, and what may be another unit or convention."""


def read_cameras(
    paths: Path | Sequence[Path],
    units: Units | None = None,
    poses: PoseConvention | None = None,
    footage: Collection[str] = (),
    any_size: bool = False,
) -> CalibratedCameras:
    """Read the cameras of a calibration.

    Args:
        paths: a file; a folder; or several files, one for each camera.
        units: unit of the translations; by default the one that the layout fixes, else metres.
        poses: convention of the poses; by default that of the layout, if the cameras do not contradict it.
        footage: names of cameras that have footage, by which the names of files with one camera are told.
        any_size: whether to take unusual distances and focal lengths.

    Raises:
        CalibrationError: a file is missing or malformed, of an unknown layout, or describes impossible cameras.
    """
    if units is not None and units not in METRES:
        raise CalibrationError(f"expected the unit {', '.join(METRES)}, found '{units}'; correct it")
    if poses is not None and poses not in CONVENTIONS:
        raise CalibrationError(f"expected as convention {', '.join(CONVENTIONS)}, found '{poses}'; correct it")
    documents = _documents([Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths])
    layout, sections = _sections(documents, footage)
    where = documents[0][0].where
    reasons = {key: reason for key, section in sections.items() if (reason := _reason(section)) is not None}
    usable = {key: section for key, section in sections.items() if key not in reasons}
    left_out = {str(sections[key]["name"]): reason for key, reason in reasons.items()}
    if not usable:
        raise _nothing_usable(sections, documents[0][0])
    usable = pose_conventions.with_quaternions(usable, where, poses)
    stated = None if units else _stated_metres(usable, where)
    used: Units = units or (layout.unit if stated is None else None) or "m"
    metres = METRES[used] if stated is None else stated
    entries = tuple(_entry(name, section, where, metres, poses) for name, section in usable.items())
    notes = [f"Camera '{name}' is left out: {reason}." for name, reason in left_out.items()]
    notes += [layout.note] if layout.note else []
    entries, pose_notes = _with_convention(entries, usable, where, layout, poses)
    check_names(entries, where)
    notes += [*pose_notes, *_alike([entry.name for entry in entries])]
    square = next((s for d, _ in documents if (s := board_square(d)) is not None), None)
    is_sure = units is not None or stated is not None or layout.is_unit_sure
    notes += check_units(entries, where, used, square, any_size, is_sure)
    if not any_size:
        check_focal_lengths(entries, where)
    return CalibratedCameras(entries, left_out, tuple(notes))


# --- files ----------------------------------------------------------------------------------------------------------


def calibration_in(folder: Path) -> Path | None:
    """Return the only file of a folder that holds cameras, the folder if several do, and None if none can be read."""
    try:
        found = _in_folder(folder)
    except CalibrationError:
        return None
    return found[0][0].path if len(found) == 1 else folder


def _documents(paths: Sequence[Path]) -> list[tuple[Document, CalibrationLayout]]:
    """Read files with their layouts; of a folder those that have one.

    Raises:
        CalibrationError: a given file has none, or a folder holds no calibration or several.
    """
    if len(paths) == 1 and paths[0].is_dir():
        return _in_folder(paths[0])
    found = []
    for path in paths:
        document, layout = _read(path)
        if layout is None:
            raise foreign(path, document.data)
        found.append((document, layout))
    if len(paths) == 1:
        return _with_other_half(found[0])
    return found


def _read(path: Path) -> tuple[Document, CalibrationLayout | None]:
    """Read a file and find its layout.

    Raises:
        CalibrationError: it is no text, malformed, or of a program whose files are not read.
    """
    document = read_document(path)
    refuse_program(path, document.data)
    return document, find_layout(document)


def _in_folder(folder: Path) -> list[tuple[Document, CalibrationLayout]]:
    found_files = paths_in(folder, CalibrationError, lambda name: name.lower().endswith(_SUFFIXES))
    files = [path for path in found_files if path.is_file()]
    found: list[tuple[Document, CalibrationLayout]] = []
    failure: CalibrationError | None = None
    for path in files[:_MAX_FILES]:
        try:
            document, layout = _read(path)
        except CalibrationError as error:
            failure = error
            continue
        if layout is not None:
            found.append((document, layout))
    if not found:
        if failure is not None:
            raise failure
        for path in paths_in(folder, CalibrationError)[:_MAX_FILES]:
            name_binary(path)
        raise named(folder, "a folder without one", "give the files of the cameras")
    if len({layout.name for _, layout in found}) > 1:  # lenses alone may lie beside cameras that have theirs
        found = [f for f in found if any(_reason(s) is None for s in f[1].read(f[0]).values())] or found
    if len({layout.name for _, layout in found}) > 1:
        names = ", ".join(document.path.name for document, _ in found[:4])
        raise named(folder, f"a folder with calibrations of several layouts, {names}", "give one of these files")
    return found


def _with_other_half(found: tuple[Document, CalibrationLayout]) -> list[tuple[Document, CalibrationLayout]]:
    """Add the other half of a pair of files, which lies beside it."""
    path, layout = found[0].path, found[1]
    for begin, other in permutations(layout.halves) if layout.halves else ():
        pair = path.with_name(other + path.name.removeprefix(begin))
        if path.name.startswith(begin) and pair.is_file():
            document, its_layout = _read(pair)
            return [found, (document, its_layout)] if its_layout is layout else [found]
    return [found]


def _sections(
    documents: list[tuple[Document, CalibrationLayout]], footage: Collection[str]
) -> tuple[CalibrationLayout, dict[str, Section]]:
    """Return the cameras of all files by name."""
    first, layout = documents[0]
    if other := next((d for d, its_layout in documents if its_layout.name != layout.name), None):
        raise refuse(first, None, "files of one layout", f"another one in {other.path.name}", "give one calibration")
    joined = layout.join([document for document, _ in documents])
    stems = _camera_names([document.stem for document in joined], footage)
    found: dict[str, Section] = {}
    for document, stem in zip(joined, stems, strict=True):
        for name, section in layout.read(document).items():
            name = name or stem
            if name in found:
                twice = f"camera '{name}' is in two files or twice"
                raise CalibrationError(f"{document.where}: {twice}; give each camera its own name")
            found[name] = section | {"name": nfc_name(plain_text(section.get("name") or name))}
    return layout, found


def _camera_names(stems: list[str], footage: Collection[str]) -> list[str]:
    """Name cameras by their files; without what all names share at both ends, where the footage has these names."""
    names = [nfc_name(stem) for stem in stems]
    if len(names) < 2 or any(name in footage for name in names):
        return names
    start, end = _shared([*names]), _shared([name[::-1] for name in names])
    shorter = [name[start : len(name) - end] for name in names]
    return shorter if any(name in footage for name in shorter) else names


def _shared(names: list[str]) -> int:
    """Return how many letters all names share at their beginning, up to a separator."""
    first, last = min(names), max(names)
    count = next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    return max((i + 1 for i in range(count) if not first[i].isalnum()), default=0)


# --- cameras --------------------------------------------------------------------------------------------------------


def _reason(section: Section) -> str | None:
    """Return why a camera cannot be used; None if it can."""
    if "refusal" in section:
        return str(section["refusal"])
    if section["matrix"] is None or is_absent(section["matrix"]):
        return "the calibration has no matrix of its lens"
    if section["rotation"] is None or section["translation"] is None:
        return "the calibration has no pose for it"
    return None


def _nothing_usable(sections: dict[str, Section], document: Document) -> CalibrationError:
    """Return the error of a file all of whose cameras lack the same."""
    if not sections:
        advice = "export it in a layout that docs/log/recordings.md lists"
        return refuse(document, None, "one section for each camera", "none", advice)
    name, section = next(iter(sections.items()))
    if "refusal" in section:
        return CalibrationError(f"{document.where}: {section['refusal']}")
    if section["matrix"] is None:
        expected, advice = "its matrix under a key such as K or camera_matrix", "give the file of the intrinsics too"
        return refuse(document, name, expected, "none", f"{advice}, or one file with both")
    expected = "its pose under keys such as R and t (X_camera = R X_world + t)"
    advice = "if its poses lie elsewhere, move them to the cameras; else calibrate the cameras together"
    return refuse(document, name, expected, "the lens alone", advice)


def _stated_metres(sections: dict[str, Section], where: str) -> float | None:
    """Return the metres per unit that the cameras of a file state; None if they state none.

    Raises:
        CalibrationError: a unit is not known, or they state several.
    """
    words = {section["unit"] for section in sections.values() if section.get("unit")}
    metres = {METRES_BY_WORD.get(word) for word in words}
    if not words:
        return None
    if None in metres or len(metres) > 1:
        found = " and ".join(quoted(word) for word in sorted(words))
        expected = "one unit of its translations such as m, cm, mm, in or ft"
        raise CalibrationError.mismatch(where, expected, found, Remedy("scale_calibration", units=", ".join(METRES)))
    return metres.pop()


def _entry(name: str, section: Section, where: str, metres: float, poses: PoseConvention | None) -> CameraEntry:
    """Check one camera.

    Raises:
        CalibrationError: it describes no possible camera.
    """
    if is_transposed(section["matrix"]):
        if poses is None or not poses.startswith("row-vectors"):
            raise CalibrationError(
                f"{where}, camera '{name}': expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] as matrix, found the "
                "principal point in the last row, so that the file holds row vectors, as MATLAB writes them, and its "
                "rotations are transposed too",
                Remedy("give_poses", poses="row-vectors", rewrite="transpose K and R of all cameras"),
            )
        section = section | {"matrix": [list(column) for column in zip(*section["matrix"], strict=True)]}
    return read_entry(name, section, where, metres)


def _with_convention(
    entries: tuple[CameraEntry, ...],
    sections: Mapping[str, Section],
    where: str,
    layout: CalibrationLayout,
    poses: PoseConvention | None,
) -> tuple[tuple[CameraEntry, ...], list[str]]:
    """Return the cameras with their poses in the right convention, and notes where it is not sure."""
    stated: list[Array] = [rigid.inverse(entry.T_world_camera) for entry in entries]
    if poses is None:
        is_turned = not layout.has_opencv_poses
        words = (where, layout.poses_in_words, layout.by_program, is_turned)
        pose_conventions.refuse_angles(sections, stated, where)
        odd, elsewhere = pose_conventions.odd_camera(stated), "looks elsewhere than all others, which see one place"
        try:
            notes = [
                pose_conventions.check_convention(stated, *words),
                pose_conventions.check_turned([entry.T_world_camera for entry in entries], where),
            ]
        except CalibrationError:
            _refuse_placeholder(entries, stated, words)
            if odd is not None:
                place, found = f"{where}, camera {quoted(entries[odd].name)}", f"one by which it {elsewhere}"
                raise CalibrationError.mismatch(place, "its pose", found, _CORRECT_POSE) from None
            raise
        if odd is not None:
            notes.append(f"Camera {quoted(entries[odd].name)} {elsewhere}: check its pose.")
        return entries, [note for note in notes if note is not None]
    changed = [rigid.inverse(pose_conventions.read_pose(T, poses)) for T in stated]
    return tuple(replace(e, T_world_camera=T) for e, T in zip(entries, changed, strict=True)), []


def _alike(names: Sequence[str]) -> list[str]:
    """Return sentences on names that differ in case or spaces alone."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault("".join(name.casefold().split()), []).append(quoted(name))
    return [
        f"Cameras {' and '.join(group)} differ in case or spaces alone: check that they are different cameras."
        for group in groups.values()
        if len(group) > 1
    ]


def _refuse_placeholder(
    entries: Sequence[CameraEntry], stated: Sequence[Array], words: tuple[str, str, bool, bool]
) -> None:
    """Refuse a camera without any rotation, if the others see one place: programs fill in what they do not know.

    Raises:
        CalibrationError: there is one.
    """
    unturned = [np.array_equal(T[:3, :3], np.eye(3)) for T in stated]
    others = [T for T, is_unturned in zip(stated, unturned, strict=True) if not is_unturned]
    if not any(unturned) or len(others) < 2:
        return
    try:
        pose_conventions.check_convention(others, *words)
    except CalibrationError:
        return
    name = entries[unturned.index(True)].name
    found = "no rotation, as of a camera that is not calibrated, while the others see one place"
    raise CalibrationError.mismatch(f"{words[0]}, camera {quoted(name)}", "its pose", found, _CORRECT_POSE)
