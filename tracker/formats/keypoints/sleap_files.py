"""Files that sleap-io reads: SLEAP's projects and analyses.

sleap-io is an optional package. A file may have several videos, one for each camera.
"""

from pathlib import Path
from typing import Any

import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_table import PictureTable, stack_tracks
from tracker.formats.number_rows import check_size
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
    pictures = sorted((lf for lf in labels.labeled_frames if lf.video is video), key=lambda lf: lf.frame_idx)
    numbers = np.array([lf.frame_idx for lf in pictures], dtype=np.int64)
    if not len(numbers) or (np.diff(numbers) <= 0).any() or numbers[0] < 0 or numbers[-1] > MAX_FRAMES:
        raise FormatError(f"{where}: expected each picture once, found {len(numbers)}; export it again")
    found = [_instances(lf) for lf in pictures]
    most = max(1, *map(len, found))
    check_size((len(numbers), most, len(names), 3), where)
    points = np.full((len(numbers), most, len(names), 3), np.nan)
    for row, instances in zip(points, found, strict=True):
        for k, instance in enumerate(instances):
            row[k, :, :2] = instance.numpy()
            row[k, :, 2] = instance.points["score"] if "score" in instance.points.dtype.names else np.nan
    absent = ~np.isfinite(points[..., :2]).all(axis=-1)
    if not (np.abs(points[~absent][:, :2]) <= MAX_NUMBER).all():
        raise FormatError(f"{where}: expected coordinates within {MAX_NUMBER:g}; export it again")
    points[absent] = (np.nan, np.nan, 0.0)
    tracks = stack_tracks([[i.track.name if i.track is not None else "" for i in instances] for instances in found])
    is_by_hand = not any(hasattr(i, "score") for instances in found for i in instances)
    return PictureTable(names, numbers, points, tracks=tracks, is_by_hand=is_by_hand)


def _instances(picture: Any) -> list[Any]:
    """Return the people of a picture: those that a person set, and predicted ones from which none was made."""
    corrected = {id(i.from_predicted) for i in picture.user_instances}
    return [*picture.user_instances, *(i for i in picture.predicted_instances if id(i) not in corrected)]
