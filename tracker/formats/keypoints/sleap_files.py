"""Read SLEAP's projects and analyses by sleap-io, an optional package, and replace points in them by h5py.

A file may have several videos, one for each camera. All runs in the process that reads HDF5 files.
"""

from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_table import (
    Changes,
    PicturePerson,
    PictureTable,
    placed_points,
    places_by_presence,
    table_of_people,
)
from tracker.geometry.arrays import Array
from tracker.validation import MAX_FRAMES, MAX_NUMBER


def read_sleap(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: the file has no key points, or several skeletons.
        ImportError: sleap-io is not installed. The library raises other errors for a damaged file.
    """
    where = f"file {path}"
    import sleap_io

    labels = sleap_io.load_file(str(path), **({"open_videos": False} if path.suffix.lower() == ".slp" else {}))
    labelled = {id(frame.video) for frame in labels.labeled_frames}
    out = [(_video_path(v, path), _table(labels, v, where)) for v in labels.videos if id(v) in labelled]
    if not out:
        raise FormatError(f"{where}: expected key points of a video, found none; export it again")
    return out


def _video_path(video: Any, path: Path) -> Path:
    name = video.filename
    name = name[0] if isinstance(name, list) and name else name
    return Path(str(name).replace("\\", "/")) if name else path


def _table(labels: Any, video: Any, where: str) -> PictureTable:
    """Return the key points of one video of labels."""
    if len(labels.skeletons) != 1:
        raise FormatError(f"{where}: expected one skeleton, found {len(labels.skeletons)}; export them apart")
    names = tuple(str(n) for n in labels.skeletons[0].node_names)
    pictures = [lf for lf in labels.labeled_frames if lf.video is video]
    found = {int(lf.frame_idx): _people(lf) for lf in pictures}
    if len(found) < max(len(pictures), 1) or min(found) < 0 or max(found) > MAX_FRAMES:
        raise FormatError(f"{where}: expected each picture once, found {len(pictures)}; export it again")
    people = {number: [_person(i, where) for i in instances] for number, instances in found.items()}
    is_by_hand = not any(hasattr(i, "score") for instances in found.values() for i in instances)
    return table_of_people(people, where, names, is_by_hand=is_by_hand)


def _person(instance: Any, where: str) -> PicturePerson:
    points = np.full((len(instance.points), 3), np.nan)
    points[:, :2] = instance.numpy()
    if "score" in instance.points.dtype.names:
        points[:, 2] = instance.points["score"]
    points[~np.isfinite(points[:, :2]).all(axis=1)] = (np.nan, np.nan, 0.0)
    if (np.abs(points[:, :2]) > MAX_NUMBER).any():
        raise FormatError(f"{where}: expected coordinates within {MAX_NUMBER:g}; export it again")
    return PicturePerson(points, instance.track.name if instance.track is not None else "")


def _people(picture: Any) -> list[Any]:
    """Return the people of a picture: those that a person set, and predicted ones from which none was made."""
    corrected = {id(i.from_predicted) for i in picture.user_instances}
    return [*picture.user_instances, *(i for i in picture.predicted_instances if id(i) not in corrected)]


_Rows = NDArray[np.void]
"""A table of HDF5 with named columns."""


class _By(IntEnum):
    """The source of an instance."""

    HAND = 0
    NETWORK = 1


def is_analysis(path: Path) -> bool:
    """Return whether a file is an analysis in the order of axes that SLEAP itself writes."""
    import h5py

    with h5py.File(path) as file:
        if not {"tracks", "track_occupancy"} <= file.keys():
            return False
        shape = file["tracks"].shape
        return len(shape) == 4 and shape[1] == 2 and file["track_occupancy"].shape == (shape[3], shape[0])


def patch_analysis(path: Path, changes: Changes) -> None:
    """Replace points of some rows of an analysis: of tracks that are in the picture, in order, or of free ones.

    Raises:
        FormatError: no track is free for a person who was not found.
    """
    import h5py

    with h5py.File(path, "r+") as file:
        tracks, occupancy = file["tracks"], file["track_occupancy"]
        points, is_there = tracks[:], occupancy[:]  # (n_tracks, 2, n_points, n_frames), (n_frames, n_tracks)
        scores = file["point_scores"][:] if "point_scores" in file else np.zeros((len(points), *points.shape[2:]))
        seen = np.isfinite(points).any(axis=(1, 2))
        numbers = np.flatnonzero(seen.any(axis=0)).tolist()  # rows of the table: frames that show somebody
        problem = "expected a track for a person who was not found on frame {}, found none"
        for row, track, point, xyc in placed_points(changes, places_by_presence(seen[:, numbers].T), problem, numbers):
            points[track, :, point, numbers[row]] = xyc[:2]
            scores[track, point, numbers[row]] = xyc[2]
            is_there[numbers[row], track] = 1
        tracks[:], occupancy[:] = points, is_there
        if "point_scores" in file:
            file["point_scores"][:] = scores


def patch_project(path: Path, changes: Mapping[int, Changes]) -> None:
    """Replace points in some pictures of a project's videos, given by number. A new person becomes an instance."""
    import h5py

    with h5py.File(path, "r+") as file:
        names = ("frames", "instances", "points", "pred_points")
        tables = {name: file[name][:] for name in names}
        # Until version 1.1 the corner of the first pixel was the origin; sleap-io reads from its centre.
        offset = 0.5 if float(file["metadata"].attrs.get("format_id", 1.0)) < 1.1 else 0.0
        video_ids = np.unique(tables["frames"]["video"])
        for video, rows in changes.items():
            of_video = np.flatnonzero(tables["frames"]["video"] == video_ids[video])
            of_video = of_video[np.argsort(tables["frames"]["frame_idx"][of_video], kind="stable")]
            for row, people in rows.items():
                for person, values in sorted(people, key=lambda one: one[0] < 0):  # new ones change numbers of others
                    at = _new_instance(tables, of_video[row], len(values)) if person < 0 else None
                    instance = _instances(tables, of_video[row])[person] if at is None else at
                    _set_points(tables, instance, values, offset)
        for name in names:
            replace_dataset(file, name, tables[name])


def _instances(tables: Mapping[str, _Rows], frame: int) -> list[int]:
    """Return the instances of a picture in the order in which they are read: those of a person, then other ones."""
    first, end = (int(tables["frames"][frame][key]) for key in ("instance_id_start", "instance_id_end"))
    own, types = np.arange(first, end), tables["instances"]["instance_type"][first:end]
    by_hand = own[types != _By.NETWORK]
    replaced = set(tables["instances"]["from_predicted"][by_hand].tolist())
    return [*by_hand.tolist(), *(i for i in own[types == _By.NETWORK].tolist() if i not in replaced)]


def _new_instance(tables: dict[str, _Rows], frame: int, n_points: int) -> int:
    """Add an instance without points to a picture, as a person sets one; return its number."""
    frames, instances, points = tables["frames"], tables["instances"], tables["points"]
    at = int(frames[frame]["instance_id_end"])
    new = np.zeros(1, instances.dtype)
    for key, value in {"frame_id": frames[frame]["frame_id"], "track": -1, "from_predicted": -1}.items():
        new[key] = value
    new["point_id_start"], new["point_id_end"] = len(points), len(points) + n_points
    later = instances["from_predicted"] >= at
    instances["from_predicted"][later] += 1
    instances = np.insert(instances, at, new)
    instances["instance_id"] = np.arange(len(instances))
    others = (np.arange(len(frames)) != frame) & (frames["instance_id_start"] >= at)
    frames["instance_id_start"][others] += 1
    frames["instance_id_end"][others] += 1
    frames["instance_id_end"][frame] += 1
    empty = np.zeros(n_points, points.dtype)
    empty["x"] = empty["y"] = np.nan
    tables["instances"], tables["points"] = instances, np.concatenate([points, empty])
    return at


def _set_points(tables: Mapping[str, _Rows], instance: int, values: Array, offset: float) -> None:
    """Set x, y, confidence of the points of an instance, (n_points, 3); rows of NaN stay, confidence 0 is absent."""
    one = tables["instances"][instance]
    own = tables["pred_points" if one["instance_type"] == _By.NETWORK else "points"]
    own = own[int(one["point_id_start"]) : int(one["point_id_end"])]  # a view
    point: Any
    for point, (x, y, confidence) in zip(own, values.tolist(), strict=True):
        if np.isnan(confidence):
            continue
        absent = confidence == 0
        point["x"], point["y"] = (np.nan, np.nan) if absent else (x + offset, y + offset)
        point["visible"] = not absent
        if "score" in (own.dtype.names or ()):
            point["score"] = confidence


def replace_dataset(file: Any, name: str, rows: NDArray[Any]) -> None:
    """Write a table; one of another length is made again, with its attributes."""
    table = file[name]
    if table.shape == rows.shape:
        table[:] = rows
        return
    attributes = dict(table.attrs)
    del file[name]
    file.create_dataset(name, data=rows).attrs.update(attributes)
