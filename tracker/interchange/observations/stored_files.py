"""The imported files of stored key points, read again: where each frame and person stands in them."""

import json
from pathlib import Path
from typing import NamedTuple

from tracker.formats.keypoints.picture_table import PictureTable
from tracker.geometry.arrays import IntArray
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.placing import place_pictures
from tracker.interchange.observations.readers import PICTURE_FORMATS
from tracker.interchange.observations.sources import match_cameras, videos_of_footage
from tracker.interchange.observations.stored import files_folder, source_path
from tracker.session.session import Session


class StoredPictures(NamedTuple):
    """The files of one camera."""

    camera: str
    files: tuple[Path, ...]
    """Within the session: one for each picture, or one for all."""
    table: PictureTable
    """Their content, in the pixels of the file."""
    frames: IntArray
    """Frame of the session of each picture, (n,)."""
    part: int
    """Number of this camera among those that the files hold."""


def stored_pictures(session: Session, observations: ObservationSet) -> list[StoredPictures]:
    """Read the files of key points again, and place them as they were when they were imported.

    Raises:
        FormatError: a file was changed meanwhile, so that it cannot be read.
    """
    of_path = {source_path(session, observations.name, s): s for s in observations.sources}
    root = files_folder(session, observations.name)
    groups = PICTURE_FORMATS[observations.format].read([(path, root) for path in of_path], session.camera_names)
    is_own = videos_of_footage([g for g, _ in groups], {c.camera.name: c.footage for c in session.cameras})
    pairs = zip(groups, is_own, strict=True)
    labels = [g.labels if own and not of_path[g.files[0]].camera else () for (g, _), own in pairs]
    matched = match_cameras([(n, g.place) for n, (g, _) in zip(labels, groups, strict=True)], session.camera_names, {})
    cameras = [of_path[g.files[0]].camera or name for (g, _), name in zip(groups, matched, strict=True)]
    tables = {name: table for name, (_, table) in zip(cameras, groups, strict=True) if name}
    options = dict(observations.options)
    first, late = options.get("first_frame"), json.loads(options.get("offsets", "{}"))
    frames, _, _ = place_pictures(tables, session, None if first is None else int(first), late)
    first_files = [group.files[0] for group, _ in groups]
    return [
        StoredPictures(name, group.files, table, frames[name], first_files[:i].count(group.files[0]))
        for i, (name, (group, table)) in enumerate(zip(cameras, groups, strict=True))
        if name
    ]
