"""The table of all layouts of key points, masks and joints of other programs. `docs/log/observations.md` lists it."""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from tracker.errors import FormatError
from tracker.footage.image_file import LabelImage, read_label_image
from tracker.formats.bvh_reading import read_bvh
from tracker.formats.c3d import patch_c3d, read_c3d
from tracker.formats.joint_tables.layouts import SCENES, Scenes, find_layout, patch_table, read_joint_files
from tracker.formats.keypoints import detections, hand_labels
from tracker.formats.keypoints.coco_reading import holds, is_alphapose, is_coco, patch_coco, patch_openpose, read_coco
from tracker.formats.keypoints.coco_segmentation import SegmentedPictures, check_mask_size, read_segmentations
from tracker.formats.keypoints.deeplabcut import is_deeplabcut, patch_deeplabcut_csv, read_deeplabcut_csv
from tracker.formats.keypoints.detections import read_openpose
from tracker.formats.keypoints.hdf5 import patch_hdf5_apart, read_hdf5_apart
from tracker.formats.keypoints.picture_table import PicturePerson, PictureTable, table_of_files
from tracker.formats.observation_layout import ObservationLayout, Sample, unread
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_json
from tracker.formats.trc import MarkerTable, patch_trc, read_trc
from tracker.interchange.observations.plans import MaskFiles
from tracker.interchange.observations.sources import FileGroup, Found, folder_labels, list_files, numbered_groups
from tracker.validation import quoted

_JSON = TextKind("file", TABLE_BYTES, FormatError, "export it again")
Groups: TypeAlias = list[tuple[FileGroup, PictureTable]]
_Read: TypeAlias = Callable[[Sequence[Found], Sequence[str]], Groups]
"""Reads files, each with the folder it is relative to, of cameras of some names."""


def _by_picture(people_of: Callable[[Path], list[PicturePerson]], **more: Any) -> _Read:
    """Return the reader of files with the people of one picture each."""

    def read(files: Sequence[Found], cameras: Sequence[str]) -> Groups:
        out = []
        for group in numbered_groups(files, cameras):
            numbered = [(path, picture.number) for path, picture in zip(group.files, group.pictures, strict=True)]
            out.append((group, table_of_files(numbered, people_of, f"folder {group.files[0].parent}", **more)))
        return out

    return read


def _each(read: Callable[[Path, float | None], MarkerTable]) -> Callable[[Sequence[Path], float | None, float], Scenes]:
    return lambda paths, unit_m, rate: [(path, read(path, unit_m)) for path in paths]


def _by_file(read_file: Callable[[Path], PictureTable]) -> _Read:
    """Return the reader of files with the pictures of one camera each."""
    return _by_cameras(lambda path: [((), read_file(path))])


def _by_cameras(read_file: Callable[[Path], Sequence[tuple[tuple[str, ...], PictureTable]]]) -> _Read:
    """Return the reader of files with the pictures of several cameras, which may have names."""
    return lambda files, cameras: [
        (FileGroup((path,), (*labels, *folder_labels(path, root)), root), table)
        for path, root in files
        for labels, table in read_file(path)
    ]


def _read_hdf5(files: Sequence[Found], cameras: Sequence[str]) -> Groups:
    out = []
    for path, root in files:
        found = read_hdf5_apart(path)
        for video, table in found:
            # A file of one camera is named after it more often than after its video.
            of_video = (video.stem, video.parent.name)
            own = folder_labels(path, root)
            labels = (*own, *of_video) if len(found) == 1 else of_video
            out.append((FileGroup((path,), labels, root, video=video), table))
    return out


def _read_png(files: Sequence[Found], cameras: Sequence[str]) -> list[MaskFiles]:
    return [_png_masks(group) for group in numbered_groups(files, cameras)]


def _png_masks(group: FileGroup) -> MaskFiles:
    numbers = group.numbers
    files: dict[int, list[tuple[Path, str]]] = {number: [] for number in numbers}
    for path, picture in zip(group.files, group.pictures, strict=True):
        files[picture.number].append((path, picture.label))
    objects = sorted({picture.label for picture in group.pictures}, key=_natural)
    is_by_object = any(len(some) > 1 for some in files.values())

    def read_file(path: Path, size: tuple[int, int]) -> LabelImage:
        image = read_label_image(path, "mask")
        height, width = image.labels.shape
        check_mask_size((width, height), size, f"mask {path}")
        return image

    def read(i: int, size: tuple[int, int]) -> LabelImage:
        if not is_by_object:
            return read_file(files[numbers[i]][0][0], size)
        out = np.zeros(size[::-1], np.uint8)
        for path, label in files[numbers[i]]:
            out[read_file(path, size).labels > 0] = 1 + objects.index(label)
        return LabelImage(out)

    if len(objects) > np.iinfo(np.uint8).max:
        raise FormatError(f"folder {group.files[0].parent}: expected masks of up to 255 objects, found {len(objects)}")
    values = ", ".join(f"{label or 'the plain name'} = {1 + i}" for i, label in enumerate(objects[:5]))
    notes = (f"masks of several objects were put together, with the values {values}",) if is_by_object else ()
    return MaskFiles(group, np.array(numbers, dtype=np.int64), read, notes)


def _natural(text: str) -> list[str]:
    """Return a key that sorts 2 before 10."""
    return [part.zfill(len(text)) for part in re.split(r"([0-9]+)", text)]


def _read_coco_masks(files: Sequence[Found], cameras: Sequence[str]) -> list[MaskFiles]:
    return [
        _coco_masks(found, FileGroup((path,), (*found.labels, *folder_labels(path, root)), root))
        for path, root in files
        for found in read_segmentations(path)
    ]


def _coco_masks(found: SegmentedPictures, group: FileGroup) -> MaskFiles:
    numbers = sorted(found.images)
    return MaskFiles(
        group,
        np.array(numbers, dtype=np.int64),
        lambda i, size: LabelImage(found.labels_of(numbers[i], size)),
        found.notes,
    )


_END = "the end of the name"


def _has(*keys: str) -> Callable[[Sample], bool]:
    """Return whether a JSON file is a group of keys with some of them all."""
    return _is_json(lambda data: isinstance(data, dict) and data.keys() >= {*keys})


def _ends(*suffixes: str) -> Callable[[Sample], bool]:
    return lambda sample: sample.suffix in suffixes


def _is_text(suffix: str, recognizes: Callable[[Sequence[str]], bool]) -> Callable[[Sample], bool]:
    return lambda sample: sample.suffix == suffix and recognizes(sample.head)


def _is_json(recognizes: Callable[[Any], bool]) -> Callable[[Sample], bool]:
    return lambda sample: sample.suffix == ".json" and recognizes(sample.data)


def _in_space(
    name: str, read: Callable[..., Scenes], patch: Callable[..., bytes] | None = None
) -> ObservationLayout[Scenes]:
    """Return the row of a format that is known by the end of its files' names alone."""
    suffix = f".{name.lower()}"
    return ObservationLayout(name, f"a `{suffix}` for each person", _END, _ends(suffix), read, patch)


def _is_scene(sample: Sample) -> bool:
    return sample.suffix == ".json" and find_layout(sample) in SCENES


_CAMERA, _PICTURE = "for each camera", "for each picture, as `CAMERA/CAMERA_000012`"
_ALL = "one `.json` for all cameras, or one for each"
_IN_SPACE = "see [Joints in space](#joints-in-space)"

PICTURE_FORMATS: Mapping[str, ObservationLayout[Groups]] = {
    "openpose": ObservationLayout("OpenPose JSON", f"a `.json` {_PICTURE}; of Pose2Sim too", "`people`", _has("people"),
        _by_picture(read_openpose), patch_openpose),
    "easymocap": ObservationLayout("EasyMocap", f"a `.json` {_PICTURE}", "`annots`", _has("annots"),
        _by_picture(detections.read_easymocap)),
    "mmpose": ObservationLayout("mmpose, of videos", f"a `.json` {_CAMERA}",
        "`frame_id` and `instances`, perhaps in `instance_info`", _is_json(detections.is_mmpose_video),
        _by_file(detections.read_mmpose_video)),
    "mmpose pictures": ObservationLayout("mmpose, of pictures", f"a `.json` {_PICTURE}",
        "a list of `keypoints` and `keypoint_scores`", _is_json(detections.is_mmpose_picture),
        _by_picture(detections.read_mmpose_picture)),
    "alphapose": ObservationLayout("AlphaPose", f"a `.json` {_CAMERA}", "a list of `image_id` in words",
        _is_json(is_alphapose), _by_cameras(lambda path: read_coco(path, "AlphaPose")), patch_coco),
    "label studio": ObservationLayout("Label Studio", _ALL, "a list of `data` and `annotations`",
        _is_json(hand_labels.is_label_studio), _by_cameras(hand_labels.read_label_studio)),
    "coco": ObservationLayout("COCO", f"{_ALL}; of Roboflow too", "`images` and `annotations`, or a list of results",
        _is_json(lambda data: is_coco(data) and (holds(data, "keypoints") or not holds(data, "segmentation"))),
        _by_cameras(read_coco), patch_coco),
    "deeplabcut": ObservationLayout("DeepLabCut, Lightning Pose, EKS",
        f"a `.csv` {_CAMERA}, of one animal or several, or of labels", "the row `scorer`, without `z`",
        _is_text(".csv", is_deeplabcut), _by_file(read_deeplabcut_csv), patch_deeplabcut_csv),
    "sleap csv": ObservationLayout("SLEAP's analysis in CSV", f"a `.csv` {_CAMERA}", "columns `track` and `frame_idx`",
        _is_text(".csv", detections.is_sleap_csv), _by_file(detections.read_sleap_csv)),
    "hdf5": ObservationLayout("SLEAP, NWB, DeepLabCut in HDF5", f"a `.slp`, `.nwb` or `.h5` {_CAMERA}",
        f"{_END}, and the groups within", _ends(".slp", ".nwb", ".h5"), _read_hdf5, patch_hdf5_apart),
    "cvat": ObservationLayout("CVAT", f"a `.xml` {_CAMERA}, for images or for videos", "`<annotations>`",
        _is_text(".xml", hand_labels.is_cvat), _by_cameras(hand_labels.read_cvat)),
    "yolo": ObservationLayout("YOLO pose", f"a `.txt` {_PICTURE}",
        "a class, a box and points in each line, in shares of the picture", _is_text(".txt", detections.is_yolo),
        _by_picture(detections.read_yolo, size=(1, 1))),
}  # fmt: skip
"""Key points in pictures, by the name that is stored, in the order in which they are tried."""
SPACE_FORMATS: Mapping[str, ObservationLayout[Scenes]] = {
    "trc": _in_space("TRC", _each(lambda path, unit_m: read_trc(path)), lambda path, unit_m, new: patch_trc(path, new)),
    "c3d": _in_space("C3D", _each(read_c3d), patch_c3d),
    "bvh": _in_space("BVH", _each(read_bvh)),
    "scenes": ObservationLayout("JSON of people in space", _IN_SPACE, "", _is_scene, read_joint_files),
    "arrays": ObservationLayout("NumPy", _IN_SPACE, "", _ends(".npy", ".npz"), read_joint_files),
    "csv": ObservationLayout("CSV", _IN_SPACE, "", _ends(".csv", ".tsv"), read_joint_files, patch_table),
}
"""Joints in space. Lengths without a unit in the file have the given one, metres, or are refused; rows without times
have the given rate, 1/s. Each returns the points of each person with the file or folder that they are from."""
MASK_FORMATS: Mapping[str, ObservationLayout[list[MaskFiles]]] = {
    "masks": ObservationLayout("masks in PNG",
        "a `.png` for each picture, or for each object in it: `CAMERA/000012.png`", _END, _ends(".png"), _read_png),
    "coco masks": ObservationLayout("COCO segmentation", _ALL,
        "`segmentation` in `annotations`: polygons and run lengths",
        _is_json(lambda data: is_coco(data) and holds(data, "segmentation")), _read_coco_masks),
}  # fmt: skip
FORMATS: Mapping[str, ObservationLayout[Any]] = {**PICTURE_FORMATS, **SPACE_FORMATS, **MASK_FORMATS}
"""The layouts that are read, by the name that is stored."""
UNREAD = (*unread("joints"), *unread("points"))
"""Files that are known and not read."""
_OFTEN_OTHER = (".txt", ".xml")
"""Ends of names that files of notes and of cameras have too: one that is of no known program is left out."""
_OF_SPACE = (".trc", ".c3d", ".bvh", ".tsv", ".npy", ".npz")
SUFFIXES = (".json", ".csv", ".slp", ".nwb", ".h5", *_OF_SPACE, ".png", *_OFTEN_OTHER)


def find_files(paths: Sequence[Path], masks: bool = False) -> tuple[str, list[Found]]:
    """Return the name of the format of some files and folders, and the files, each with the folder it is relative to.

    Args:
        paths: of the files and folders.
        masks: whether masks are taken where there are key points too; else pictures beside other files are none.

    Raises:
        FormatError: there are none, they have several formats, or none that is read.
    """
    found: dict[str, list[Found]] = {}
    for some in _alike(_listed(paths)):
        found.setdefault(_format_of(some, masks), []).extend(some)
    unread = found.pop("", [])
    if masks and "masks" in found:
        found, unread = {"masks": found["masks"]}, []
    elif len(found) > 1 or not all(map(_may_be_other, unread)):
        found.pop("masks", None)
    if not found or not all(map(_may_be_other, unread)):
        raise _not_read(Sample(min(unread, key=_may_be_other)[0]), "leave it out, or " if found else "")
    if {*found} == {"deeplabcut", "hdf5"}:  # DeepLabCut writes each table twice
        tables = {path.with_suffix("") for path, _ in found["deeplabcut"]}
        if all(path.with_suffix("") in tables for path, _ in found["hdf5"]):
            del found["hdf5"]
    (name, files), *others = found.items()
    if others:
        listed = " and ".join(f"{some[0][0].name} ({FORMATS[n].program})" for n, some in ((name, files), *others[:1]))
        advice = "import them one after the other, or leave out those that hold no points"
        raise FormatError.mismatch("", "files of one format", listed, advice)
    if masks and name not in MASK_FORMATS:
        advice = "export PNG files or COCO segmentations"
        raise FormatError.mismatch("", "masks among the files", FORMATS[name].program, advice)
    return name, files


def _listed(paths: Sequence[Path]) -> list[Found]:
    try:
        return list_files(paths, SUFFIXES)
    except FormatError:
        if not all(path.exists() for path in paths):
            raise
        with suppress(FormatError):
            return list_files(paths, [suffix for row in UNREAD for suffix in row.suffixes])
        raise


def _alike(files: Sequence[Found]) -> list[list[Found]]:
    """Return files of a folder whose names differ in digits alone, together."""
    found: dict[tuple[Path, str], list[Found]] = {}
    for path, root in files:
        found.setdefault((path.parent, re.sub(r"[0-9]+", "0", path.name)), []).append((path, root))
    return list(found.values())


def _format_of(files: Sequence[Found], masks: bool) -> str:
    """Return the name of the format of files that are alike, by the largest; empty if it is none that is read."""
    sample = Sample(max((path for path, _ in files), key=lambda path: path.stat().st_size if path.is_file() else 0))
    tried = {**MASK_FORMATS, **FORMATS} if masks else FORMATS
    return next((name for name, layout in tried.items() if layout.recognizes(sample)), "")


def _may_be_other(file: Found) -> bool:
    return file[0].suffix.lower() in _OFTEN_OTHER


def _not_read(sample: Sample, advice: str) -> FormatError:
    """Return that a file is not read, in the words of the program that wrote it."""
    known = next((layout for layout in UNREAD if layout.recognizes(sample)), None)
    if known is not None:
        return FormatError(f"file {sample.path} is of {known.program}, which is not read; export {known.instead}")
    found = f"one that begins with {quoted(sample.head[0])}" if sample.head else "another kind of file"
    if sample.suffix == ".json":
        try:
            data = read_json(sample.path, _JSON)
        except FormatError as error:
            return error
        keys = ", ".join(map(str, data)) if isinstance(data, dict) else ""
        found = f"JSON with the keys {quoted(keys)}" if keys else f"JSON with {quoted(data)}"
    expected = "key points, joints or masks of a program that docs/log/observations.md lists"
    return FormatError.mismatch(f"file {sample.path}", expected, found, f"{advice}export it in one of its formats")
