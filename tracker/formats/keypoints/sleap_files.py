"""Files that sleap-io reads: SLEAP's projects and analyses.

sleap-io is an optional package. A file may have several videos, one for each camera.
"""

from pathlib import Path
from typing import Any

import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_table import PicturePerson, PictureTable, table_of_people
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
    found = {int(lf.frame_idx): _instances(lf) for lf in pictures}
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


def _instances(picture: Any) -> list[Any]:
    """Return the people of a picture: those that a person set, and predicted ones from which none was made."""
    corrected = {id(i.from_predicted) for i in picture.user_instances}
    return [*picture.user_instances, *(i for i in picture.predicted_instances if id(i) not in corrected)]
