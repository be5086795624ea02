"""Send imported files back in their own format: what was mended is replaced, all other bytes stay."""

from dataclasses import dataclass, replace
from pathlib import Path

from tracker.errors import FormatError, Remedy, SessionError
from tracker.interchange.exports.export_files import moved_at_end, unwritable
from tracker.interchange.exports.like.mended_points import PoseChoice, mended_points
from tracker.interchange.exports.like.patches import Files, mended_pictures, mended_space
from tracker.interchange.observations.assignment import people_by_poses
from tracker.interchange.observations.joints import observed_joints
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.stored import checksum, source_path
from tracker.session.session import Session


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


def export_like(
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
        raise FormatError(
            f"expected observations that were imported, found '{observations.name}', which was detected here and has "
            "no files to send back",
            Remedy("export_joints"),
        )
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
