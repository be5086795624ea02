"""Key points of other programs, placed at the frames of footage whose cameras are not yet calibrated."""

from collections.abc import Collection, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import NamedTuple

from tracker.boards.lens_fit import blank_camera
from tracker.errors import CalibrationError
from tracker.footage.camera_source import CameraSource
from tracker.footage.video import open_footage
from tracker.geometry.cameras import Camera
from tracker.observations.importing import plan_import
from tracker.observations.observed import ObservationSet
from tracker.observations.request import ImportRequest
from tracker.session.matching import common_length
from tracker.session.session import Session

_PERSON = "person"


class FilmedPerson(NamedTuple):
    """Key points of a person in footage."""

    observations: ObservationSet
    blanks: tuple[Camera, ...]
    """Cameras at the origin with a lens as unknown lenses are on average."""


def read_keypoints(
    files: Path, paths: Mapping[str, Path], offsets: Mapping[str, int], common_frames: bool
) -> FilmedPerson:
    """Read key points and the sizes of the pictures that they lie in.

    Args:
        files: file or folder of key points.
        paths: footage by camera name.
        offsets: frame k of all is frame k + offset of a camera.
        common_frames: whether to leave out frames at the end that some cameras lack.

    Raises:
        TrackerError: files cannot be read, or do not fit the footage.
    """
    with ExitStack() as stack:
        footage = {name: stack.enter_context(closing(open_footage(path, name))) for name, path in paths.items()}
        n_frames = common_length(footage, offsets, common_frames)
        blanks = tuple(blank_camera(name, f.size) for name, f in footage.items())
        sources = tuple(
            CameraSource(c, paths[c.name], offset=offsets.get(c.name, 0), footage_frames=footage[c.name].n_frames)
            for c in blanks
        )
        rates = [f.fps for f in footage.values() if f.fps is not None]
    # Nothing of a session is written: it states which cameras and frames there are.
    session = Session(files.parent, files.name, max(rates, default=1.0), n_frames, sources, ())
    plan = plan_import(session, ImportRequest(_PERSON, (files,), (_PERSON,)), calibrated=False)
    if plan.problems:
        raise CalibrationError(f"{plan.problems[0]}; correct the files of key points")
    if plan.observations.points is None:
        raise CalibrationError(
            f"expected key points in pictures, found points in space in {files}; name the files that a detector wrote"
        )
    _require_files({v.camera for v in plan.views if v.place is None}, files)
    return FilmedPerson(plan.observations, blanks)


def _require_files(without: Collection[str], files: Path) -> None:
    if without:
        raise CalibrationError(
            f"expected key points of each camera, found none of {', '.join(sorted(without))} in {files}; add them, or "
            "leave out that footage"
        )
