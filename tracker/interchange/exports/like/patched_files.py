"""Send imported files back in their own format: what was mended is replaced, all other bytes stay."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import velocity
from tracker.errors import FormatError, Remedy, SessionError
from tracker.formats.bvh_reading import patch_bvh
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.trc import axes_matrix
from tracker.geometry.arrays import Array
from tracker.interchange.exports.export_files import moved_at_end, unwritable
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.like.mended_points import MendedPoints, PoseChoice, mended_points
from tracker.interchange.observations.assignment import people_by_poses
from tracker.interchange.observations.importing import StoredPictures, stored_pictures
from tracker.interchange.observations.observed import (
    ObservationSet,
    observed_joints,
    side_pairs,
    triangulate_observations,
)
from tracker.interchange.observations.placing import rescaled
from tracker.interchange.observations.plans import picture_size
from tracker.interchange.observations.readers import PICTURE_FORMATS, SPACE_FORMATS
from tracker.interchange.observations.stored import checksum, source_path
from tracker.session.session import Session

Files = dict[str, bytes]
"""Content of files that differ from those that came, by their path."""
Changes = dict[int, list[tuple[int, Array]]]
"""Number of a person in the file and x, y, confidence of the points, (n_points, 3), by row."""


class ChangedPictures(NamedTuple):
    """Files of key points that change."""

    files: Files
    exchanged: tuple[tuple[int, int, int], ...]
    """Frame, person and view in which left and right were exchanged."""


def mended_pictures(
    session: Session, observations: ObservationSet, mended: Sequence[MendedPoints], exchange_sides: bool = False
) -> ChangedPictures:
    """Return the files of key points that change.

    Args:
        session: its cameras.
        observations: whose files change.
        mended: points of each person that are replaced.
        exchange_sides: exchange left and right where they were found exchanged; points that are replaced stay so.
    """
    cameras = [c.camera for c in session.cameras]
    triangulated, pairs = triangulate_observations(observations, cameras), side_pairs(observations)
    detections, is_exchanged = triangulated.detections, triangulated.is_exchanged & exchange_sides
    exchanged: list[tuple[int, int, int]] = []
    size, names = picture_size(observations.options), [c.name for c in cameras]
    by_path = {source_path(session, observations.name, s): s.path for s in observations.sources}
    found: list[tuple[StoredPictures, Changes]] = []
    for pictures in stored_pictures(session, observations):
        view = names.index(pictures.camera)
        changes: Changes = {}
        for row, frame in enumerate(pictures.frames.tolist()):
            for k, person in enumerate(mended):
                detection, values = int(detections[frame, k, view]) if 0 <= frame < len(detections) else -1, None
                if detection >= 0 and is_exchanged[frame, k, view].any():
                    exchanged.append((frame, k, view))
                    of_sides = [
                        pair for g, group in enumerate(pairs) if is_exchanged[frame, k, view, g] for pair in group
                    ]
                    values = _exchanged(pictures.table, row, detection, of_sides)
                if frame in person.bodies:
                    placed = _seen(session, view, frame, person)
                    if size is not None:
                        placed[:, :2] = rescaled(placed[:, :2], cameras[view].size, size)
                    if detection < 0 and not (placed[:, 2] > 0).any():
                        continue  # nobody is added who is not in the picture
                    values = placed if values is None else np.where(np.isnan(placed[:, 2:]), values, placed)
                if values is not None:
                    changes.setdefault(row, []).append((detection, values))
        if changes:
            found.append((pictures, changes))
    files = {by_path[path]: data for path, data in _patch_pictures(observations.format, found).items()}
    return ChangedPictures(files, tuple(exchanged))


def _exchanged(table: PictureTable, row: int, detection: int, pairs: Sequence[tuple[int, int]]) -> Array:
    """Return x, y, confidence of points whose sides are exchanged, (n_points, 3); NaN for all others."""
    points, is_found = table.points[row, detection], table.is_found[row, detection]
    sure = np.where(is_found, np.nan_to_num(points[:, 2], nan=1.0), 0.0)
    known = np.column_stack([np.where(is_found[:, None], points[:, :2], 0.0), sure])
    out = np.full(known.shape, np.nan)
    for left, right in pairs:
        out[left], out[right] = known[right], known[left]
    return out


def _patch_pictures(format_name: str, found: Sequence[tuple[StoredPictures, Changes]]) -> dict[Path, bytes]:
    layout = PICTURE_FORMATS[format_name]
    if layout.patch is None:
        raise _not_sent_back(f"files of a program to which points are sent back, found {layout.program}")
    of_file: dict[Path, dict[int, Changes]] = {}
    for pictures, changes in found:
        if len(pictures.files) > max(len(pictures.table.numbers), 1):
            raise _not_sent_back("files with one picture each, found several of one")
        for row, people in changes.items():
            # A file has one picture of a camera, or all of one or several.
            path, at = (pictures.files[row], 0) if len(pictures.files) > 1 else (pictures.files[0], row)
            of_file.setdefault(path, {}).setdefault(pictures.part, {})[at] = people
    return {path: layout.patch(path, changes) for path, changes in of_file.items()}


def _not_sent_back(difference: str) -> FormatError:
    return FormatError(f"expected {difference}", Remedy("export_other_format"))


def _seen(session: Session, view: int, frame: int, person: MendedPoints) -> Array:
    """Return x, y, confidence of a person's points in a view, (n_points, 3); confidence 0 outside of the picture."""
    source = session.cameras[view]
    body, ahead = person.bodies[frame], source.clock.offset_frames(frame)
    if ahead:
        near = {f: b.values for f, b in person.all_bodies.items() if abs(f - frame) <= 2 and b.model is body.model}
        body = PosedBody(body.model, body.values, velocity(body.model, near, frame)).ahead(ahead)
    points = person.points_world(body)
    points[~person.replaced[frame]] = np.nan
    known = np.asarray(np.isfinite(points).all(axis=-1))
    px = np.full((len(points), 2), np.nan)
    px[known] = project_through_lens(source.camera, points[known])
    with np.errstate(invalid="ignore"):
        inside = np.asarray(((px >= -0.5) & (px <= np.array(source.camera.size) - 0.5)).all(axis=-1))
    confidence = np.where(known, inside.astype(np.float64), np.nan)
    return np.column_stack([np.where(inside[:, None], px, 0.0), confidence])


def mended_space(session: Session, observations: ObservationSet, mended: Sequence[MendedPoints]) -> tuple[Files, float]:
    """Return the files of points in space that change, and how far a point is from its place at most, metres."""
    options = dict(observations.options)
    layout = SPACE_FORMATS[observations.format]
    R_file = axes_matrix(options.get("axes", "x,y,z")).T
    unit_m = float(options["unit_m"]) if "unit_m" in options else None
    is_known = np.array([bool(points) for points in observations.counterparts.values()])
    out, farthest_m = Files(), 0.0
    if len(observations.row_frames) != len(mended):
        raise SessionError(
            f"expected the rows of each file of {observations.name}, found those of the first; import the files again"
        )
    other = SessionError(
        f"expected one file for each person in TRC, C3D, BVH or a table with a row for each frame, into which points "
        f"are written back, found other files of {observations.name}; export the poses as TRC or CSV"
    )
    if len(observations.sources) != len(mended) or (layout.patch is None and observations.format != "bvh"):
        raise other
    for source, person, row_frames in zip(observations.sources, mended, observations.row_frames, strict=True):
        changes = _rows(row_frames, person)
        if changes:
            in_file = {row: points @ R_file.T for row, points in changes.items()}
            path = source_path(session, observations.name, source)
            read = layout.read([path], unit_m, session.fps)
            if {len(table.names) for _, table in read} != {len(is_known)} or len(read) > 1:
                raise other
            if layout.patch is None:
                out[source.path], distance_m = patch_bvh(path, unit_m, in_file, is_known)
                farthest_m = max(farthest_m, distance_m)
            else:
                out[source.path] = layout.patch(path, unit_m, in_file)
    return out, farthest_m


def _rows(row_frames: Array, person: MendedPoints) -> dict[int, Array]:
    """Return the points of each row that is nearest to a replaced frame, between two of them interpolated."""
    out: dict[int, Array] = {}
    nearest = np.round(row_frames).astype(np.int64)
    for row, (frame, at) in enumerate(zip(nearest.tolist(), row_frames.tolist(), strict=True)):
        if frame not in person.bodies:
            continue
        points = person.points_world(person.bodies[frame])
        other = frame + (1 if at > frame else -1)
        if at != frame and other in person.all_bodies:
            share = abs(at - frame)
            points = (1 - share) * points + share * person.points_world(person.all_bodies[other])
        points[~person.replaced[frame]] = np.nan
        out[row] = points
    return out


@dataclass(frozen=True)
class LikeExport:
    """Files that were sent back."""

    paths: tuple[Path, ...]
    """The files."""
    changed: tuple[Path, ...]
    """Files that differ from those that came."""
    frames: tuple[int, ...]
    """Frames whose points were replaced in some file."""
    exchanged: tuple[tuple[int, str, str], ...] = ()
    """Frame, person and camera in whose view left and right were exchanged."""
    farthest_m: float = 0.0
    """How far a replaced point is from its place at most, metres, where the format does not let it go there."""


def export_patched(
    session: Session,
    observations: ObservationSet,
    out: Path,
    poses: PoseChoice = "edited",
    learn_offsets: bool = True,
    exchange_sides: bool = False,
) -> LikeExport:
    """Write the files of observations as they came, with the points of mended poses replaced.

    Args:
        session: its stored poses.
        observations: imported ones.
        out: file to write, or the folder of several files; it must not exist.
        poses: replace the points that a person edited, or those of all poses.
        learn_offsets: place points as far from the joints as the files usually do.
        exchange_sides: key points: exchange left and right in the views and frames in which they were found exchanged.

    Raises:
        TrackerError: a stored file was changed or is missing, its format cannot be changed in place, or `out` cannot be
            written.
    """
    if exchange_sides and observations.points is None:
        raise FormatError(
            f"expected key points, in which sides can be exchanged, found the points in space '{observations.name}'"
        )
    if not observations.sources:
        found = f"'{observations.name}', which was detected here and has no files to send back"
        raise FormatError.mismatch("", "observations that were imported", found, Remedy("export_joints"))
    contents = _stored_contents(session, observations)
    cameras = [c.camera for c in session.cameras]
    joints_world = observed_joints(observations, cameras).joints_world
    if observations.points is not None:
        columns = [(names[0], i) for i, names in enumerate(observations.counterparts.values()) if len(names) == 1]
        names, at = [n for n, _ in columns], [i for _, i in columns]
        people = people_by_poses(session, observations.people, names, joints_world[:, :, at])
        observations = replace(observations, people=people)
    mended = mended_points(session, observations, joints_world, poses, learn_offsets)
    frames = sorted({f for person in mended for f in person.bodies})
    changed, farthest_m = Files(), 0.0
    exchanged: tuple[tuple[int, int, int], ...] = ()
    if observations.points is not None and (frames or exchange_sides):
        changed, exchanged = mended_pictures(session, observations, mended, exchange_sides)
    elif frames:
        changed, farthest_m = mended_space(session, observations, mended)
    changed = {path: data for path, data in changed.items() if data != contents[path]}
    paths = _write(out, contents | changed)
    named = tuple((f, observations.people[k], session.camera_names[view]) for f, k, view in exchanged)
    return LikeExport(tuple(paths.values()), tuple(paths[p] for p in changed), tuple(frames), named, farthest_m)


def _stored_contents(session: Session, observations: ObservationSet) -> Files:
    """Return the imported files.

    Raises:
        SessionError: one is missing or changed.
    """
    found: Files = {}
    for source in observations.sources:
        path = source_path(session, observations.name, source)
        try:
            found[source.path] = path.read_bytes()
        except OSError as error:
            raise SessionError(f"cannot read the imported file {path}: {error}; import it again") from error
        if checksum(found[source.path]) != source.sha256:
            raise SessionError(f"{path} is not as it was imported; import it again")
    return found


def _write(out: Path, contents: Files) -> dict[str, Path]:
    """Write one file, or a folder of several; it appears whole or not at all.

    Raises:
        TrackerError: it exists, or cannot be written.
    """
    if out.is_dir() and len(contents) == 1:
        out = out / Path(next(iter(contents))).name
    is_one = len(contents) == 1
    try:
        with moved_at_end([out], None, (lambda _: False) if not is_one else None) as folder:
            for path, data in contents.items():
                target = folder / out.name if is_one else folder / out.name / path
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(data)
    except OSError as error:
        raise unwritable(out, error) from error
    return {path: out if is_one else out / path for path in contents}
