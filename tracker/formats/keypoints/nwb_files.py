"""Key points in NWB files of ndx-pose, as SLEAP and DeepLabCut write them: read, and replaced in place.

A file has one `PoseEstimation` for each animal or person of a video, below it one series of places for each node. It
needs h5py, and runs in the process that reads HDF5 files. sleap-io numbers the pictures of such files by their order,
so that pictures without a point would shift all later ones; here the numbers follow from the times.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_table import (
    Changes,
    PictureTable,
    placed_points,
    places_by_presence,
    stack_tracks,
)
from tracker.formats.keypoints.sleap_files import replace_dataset
from tracker.formats.number_rows import check_size
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import MAX_FRAMES, MAX_NUMBER

_TYPE = "neurodata_type"
_NO_PLACE = "expected a free person for one who was not found in picture {}, found none"
_ESTIMATION, _SERIES, _SKELETON = "PoseEstimation", "PoseEstimationSeries", "Skeleton"


@dataclass(frozen=True, eq=False)
class _Video:
    """Key points of one video."""

    path: Path
    names: tuple[str, ...]
    series: list[list[Any]]
    """HDF5 group of each node, by person."""
    numbers: list[list[IntArray]]
    """Number of the picture of each of its rows."""

    @property
    def all_numbers(self) -> IntArray:
        """Numbers of all pictures, ascending."""
        return np.unique(np.concatenate([n for own in self.numbers for n in own]))


def read_nwb(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: the file has no key points in pictures, or those of several skeletons.
        ImportError: h5py is not installed. The library raises other errors for a damaged file.
    """
    import h5py

    with h5py.File(path) as file:
        return [(video.path, _table(video, f"file {path}")) for video in _videos(file, path)]


def patch_nwb(path: Path, changes: Mapping[int, Changes]) -> None:
    """Replace points in some pictures of videos, given by number; all other numbers stay.

    Raises:
        FormatError: nobody else is in the file for a person who was not found.
    """
    import h5py

    with h5py.File(path, "r+") as file:
        videos = _videos(file, path)
        for number, rows in changes.items():
            video = videos[number]
            places = places_by_presence(np.asarray(_table(video, f"file {path}").is_found.any(axis=2)))
            pictures = video.all_numbers.tolist()
            for row, person, node, xyc in placed_points(rows, places, _NO_PLACE, pictures):
                _set(video, person, node, pictures[row], xyc)


def is_of_points(group: Any) -> bool:
    """Return whether a group has key points, or a series or the skeleton of some."""
    return _text(group.attrs.get(_TYPE, "")) in (_ESTIMATION, _SERIES, _SKELETON)


def _videos(file: Any, path: Path) -> list[_Video]:
    """Return the videos of a file, in the order of the file."""
    by_video: dict[str, list[Any]] = {}
    for group in _estimations(file):
        by_video.setdefault(_video_of(group) or str(path), []).append(group)
    if not by_video:
        raise FormatError(f"file {path}: expected key points of ndx-pose, found none; export it again")
    out = []
    for video, people in by_video.items():
        nodes = {_nodes(group) for group in people}
        if len(nodes) != 1:
            raise FormatError(f"file {path}: expected one skeleton, found {len(nodes)}; export them apart")
        (names,) = nodes
        series = [[_series(group, name, path) for name in names] for group in people]
        times = [[_times(one) for one in own] for own in series]
        out.append(_Video(Path(video), names, series, _numbers(times, path)))
    return out


def _video_of(group: Any) -> str:
    """Return the name of the video of a person; empty if the file does not say."""
    for key in ("original_videos", "labeled_videos"):
        if key in group and len(group[key]):
            return _text(group[key][0])
    # Since ndx-pose 0.3 it is a series of images.
    images = [item for item in group.values() if _text(item.attrs.get(_TYPE, "")) == "ImageSeries"]
    return _text(images[0]["external_file"][0]) if images and "external_file" in images[0] else ""


def _estimations(file: Any) -> list[Any]:
    """Return the groups of people in videos, in the order of their names."""
    found: list[Any] = []
    file.visititems(lambda _, item: found.append(item) if _text(item.attrs.get(_TYPE, "")) == _ESTIMATION else None)
    return found


def _nodes(group: Any) -> tuple[str, ...]:
    """Return the names of the nodes in the order of the skeleton; that of the file if there is none."""
    kinds = {name: _text(group[name].attrs.get(_TYPE, "")) for name in group}
    own = [name for name, kind in kinds.items() if kind == _SERIES]
    skeletons = [group[name]["nodes"] for name, kind in kinds.items() if kind == _SKELETON]
    nodes = [_text(node) for node in skeletons[0]] if skeletons else own
    return tuple(nodes if {*own} == {*nodes} else own)


def _series(group: Any, name: str, path: Path) -> Any:
    series = group[name]
    data = series["data"]
    if data.ndim != 2 or data.shape[1] != 2:
        expected = f"places in pictures, two numbers for '{name}'"
        raise FormatError.mismatch(f"file {path}", expected, data.shape, "export the key points of each view")
    return series


def _times(series: Any) -> Array:
    """Return the time of each row of a series, s."""
    n = len(series["data"])
    if "timestamps" in series:
        times = np.asarray(series["timestamps"][:], dtype=np.float64)
    else:
        start = series["starting_time"]
        times = float(start[()]) + np.arange(n) / float(start.attrs.get("rate", 1.0))
    if times.shape != (n,) or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise FormatError(f"expected ascending times of {n} places, found others; export it again")
    return times


def _numbers(times: list[list[Array]], path: Path) -> list[list[IntArray]]:
    """Return the numbers of the pictures at some times: the time in steps, the smallest of which is one picture."""
    union = np.unique(np.concatenate([t for own in times for t in own]))
    if not len(union):
        raise FormatError(f"file {path}: expected key points of a video, found none; export it again")
    steps = np.diff(union)
    # The mean of steps of one picture: those of rounded times differ.
    step = float(steps[steps < 1.5 * steps.min()].mean()) if len(steps) else 1.0
    out = [[np.round(t / step).astype(np.int64) for t in own] for own in times]
    if not 0 <= union[0] <= union[-1] <= MAX_FRAMES * step or any(
        (np.diff(numbers) <= 0).any() for own in out for numbers in own
    ):
        raise FormatError(f"file {path}: expected one place for each picture, found several; export it again")
    return out


def _table(video: _Video, where: str) -> PictureTable:
    """Return the key points of a video; people who are not in a picture leave no gap."""
    pictures, n_people, n_points = video.all_numbers, len(video.series), len(video.names)
    check_size((len(pictures), n_people, n_points, 3), where)
    points = np.full((len(pictures), n_people, n_points, 3), np.nan)
    for k, own in enumerate(video.series):
        for node, series in enumerate(own):
            at = np.searchsorted(pictures, video.numbers[k][node])
            points[at, k, node, :2] = series["data"][:]
            if "confidence" in series:
                points[at, k, node, 2] = series["confidence"][:]
    absent = ~np.isfinite(points[..., :2]).all(axis=-1)
    if not (np.abs(points[~absent][:, :2]) <= MAX_NUMBER).all():
        raise FormatError(f"{where}: expected coordinates within {MAX_NUMBER:g}; export it again")
    points[absent] = (np.nan, np.nan, 0.0)
    tracks = stack_tracks([[own[0].parent.name.rpartition("/")[2] for own in video.series]] * len(pictures))
    return PictureTable(video.names, pictures, points, tracks=tracks)


def _set(video: _Video, person: int, node: int, number: int, place: tuple[float, float, float]) -> None:
    """Set a point in a picture, or remove it, where its confidence is 0; a series without this picture gets a row."""
    series, numbers = video.series[person][node], video.numbers[person][node]
    *xy, confidence = place
    at = int(np.searchsorted(numbers, number))
    if at == len(numbers) or numbers[at] != number:
        if confidence == 0:
            return
        times, new = _times(series), np.interp(number, *_scale(video))
        if "timestamps" not in series:
            start = series["starting_time"]
            series.create_dataset("timestamps", data=times).attrs.update(
                {"interval": 1, "unit": _text(start.attrs["unit"])}
            )
            del series["starting_time"]
        _insert(series, "timestamps", at, np.float64(new))
        _insert(series, "data", at, np.array([np.nan, np.nan]))
        if "confidence" in series:
            _insert(series, "confidence", at, np.float64(0.0))
        video.numbers[person][node] = np.insert(numbers, at, number)
    series["data"][at] = xy
    if "confidence" in series:
        series["confidence"][at] = confidence


def _scale(video: _Video) -> tuple[Array, Array]:
    """Return numbers of pictures and their times, s."""
    by_number: dict[int, float] = {}
    for own, series in zip(video.numbers, video.series, strict=True):
        for numbers, one in zip(own, series, strict=True):
            by_number |= dict(zip(numbers.tolist(), _times(one).tolist(), strict=True))
    known = sorted(by_number)
    return np.array(known, dtype=np.float64), np.array([by_number[n] for n in known])


def _insert(series: Any, name: str, at: int, value: Any) -> None:
    """Insert a row into an array of a series, which is written again with its attributes."""
    replace_dataset(series, name, np.insert(series[name][:], at, value, axis=0))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
