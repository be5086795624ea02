"""From footage and files of key points, or of masks, to calibrated cameras.

Silhouettes of a person in footage: from masks of other programs, or from the changes against the still room.
"""

from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tracker.calibration.boards.footage_calibration import footage_paths
from tracker.calibration.boards.rig_fit import blank_camera
from tracker.calibration.check.unsolvable import refuse_unsolvable
from tracker.calibration.self_calibration.identification import Statures
from tracker.calibration.self_calibration.keypoint_calibration import LEAST_FPS, calibrate_by_person
from tracker.calibration.self_calibration.person_calibration import PersonCalibration
from tracker.calibration.self_calibration.person_silhouettes import NOTHING, Flaw, PersonSilhouette, measure_silhouette
from tracker.calibration.self_calibration.silhouette_calibration import calibrate_by_silhouettes
from tracker.compute.progress import Report, part_of
from tracker.errors import CalibrationError
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import parts_of_mask
from tracker.footage.recording import Recording
from tracker.footage.video import open_footage
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.lengths import check_heights
from tracker.interchange.observations.importing import plan_import
from tracker.interchange.observations.plans import ImportPlan, ImportRequest, MaskPlan
from tracker.interchange.plausibility.examine import examine_keypoints
from tracker.session.matching import common_length
from tracker.session.session import Session

_PERSON = "person"


@dataclass(frozen=True)
class FilmedPerson:
    """Footage of people, and their key points, or masks of one person."""

    keypoints: Path | None
    """File or folder of key points or masks; None for silhouettes that are found in the footage itself."""
    videos: Sequence[Path] = ()
    """Video files or folders of images, each named after its camera."""
    camera_paths: Mapping[str, Path] = field(default_factory=dict)
    """Footage by camera name, under any file name."""
    offsets: Mapping[str, int] = field(default_factory=dict)
    """Frame k of all is frame k + offset of a camera."""
    common_frames: bool = False
    """Whether to leave out frames at the end that some cameras lack."""
    stature_m: Statures = None
    """Height of the person or of all, or of people by name, metres; None if unknown."""
    lenses: Path | None = None
    """Calibration of which the lenses are taken; None if they are unknown."""
    skeleton: Path | None = None
    """Joint map of the points, a file or the name of a known one; guessed by default."""
    any_size: bool = False
    """Whether people and lenses of unusual sizes are taken."""


def calibrate_filmed_person(filmed: FilmedPerson, report: Report) -> PersonCalibration:
    """Calibrate the cameras that have filmed a person.

    Args:
        filmed: the footage and its key points.
        report: receives the progress; it may raise to end the work.

    Raises:
        TrackerError: files cannot be read or do not fit together, or show too little of the people.
    """
    with refuse_unsolvable("give more of the footage, with people in many places and poses"):
        return _calibrate(filmed, report)


def _calibrate(filmed: FilmedPerson, report: Report) -> PersonCalibration:
    if not filmed.any_size:
        check_heights(filmed.stature_m, CalibrationError)
    paths = footage_paths(filmed.videos, filmed.camera_paths, filmed.offsets)
    session = footage_session(filmed.keypoints, paths, filmed.offsets, filmed.common_frames)
    blanks = tuple(c.camera for c in session.cameras)
    cameras = blanks if filmed.lenses is None else _with_lenses(blanks, filmed.lenses, filmed.any_size)
    has_lenses = filmed.lenses is not None
    plan = None if filmed.keypoints is None else plan_of_files(session, filmed.keypoints, filmed.skeleton)
    if plan is not None and not isinstance(plan, MaskPlan):
        if plan.observations.points is None:
            raise CalibrationError(
                f"expected key points in pictures, found points in space in {filmed.keypoints}; name the files of a "
                "pose detector"
            )
        fps = max(session.fps, LEAST_FPS)  # folders of images state none
        result = calibrate_by_person(plan.observations, cameras, filmed.stature_m, has_lenses, report, fps)
        if doubts := examine_keypoints(plan.observations, result.world.cameras, session.fps):
            raise doubts[0]
        return result
    if isinstance(filmed.stature_m, Mapping):
        raise CalibrationError(
            "expected one height for silhouettes, which have no names, found several; give one height"
        )
    reading, calibrating = part_of(report, 0.0, 0.5), part_of(report, 0.5, 1.0)
    if plan is None:
        silhouettes = silhouettes_in_footage(session, cameras, reading)
    else:
        silhouettes = silhouettes_in_masks(plan, session, cameras, reading)
    return calibrate_by_silhouettes(silhouettes, cameras, filmed.stature_m, has_lenses, calibrating)


def _with_lenses(blanks: Sequence[Camera], path: Path, any_size: bool) -> tuple[Camera, ...]:
    """Return cameras with the lenses of a calibration.

    Raises:
        CalibrationError: it cannot be read, lacks a camera, or is of pictures of another size.
    """
    entries = {e.name: e for e in read_cameras(path, footage=[b.name for b in blanks], any_size=any_size).entries}
    out = []
    for blank in blanks:
        if blank.name not in entries:
            raise CalibrationError(
                f"expected the lens of camera '{blank.name}' in {path}, found those of {', '.join(entries)}; add it"
            )
        camera = entries[blank.name].camera(blank.size)
        if camera.size != blank.size:
            raise CalibrationError(
                f"camera '{blank.name}': expected the lens for pictures of {blank.size[0]}x{blank.size[1]}, found "
                f"{camera.size[0]}x{camera.size[1]} in {path}; calibrate it at the size of the footage"
            )
        out.append(camera)
    return tuple(out)


def footage_session(
    files: Path | None, paths: Mapping[str, Path], offsets: Mapping[str, int], common_frames: bool
) -> Session:
    """Return a session that states which cameras and frames there are; nothing of it is written."""
    with ExitStack() as stack:
        footage = {name: stack.enter_context(closing(open_footage(path, name))) for name, path in paths.items()}
        n_frames = common_length(footage, offsets, common_frames)
        sources = tuple(
            CameraSource(
                blank_camera(name, f.size), paths[name], offset=offsets.get(name, 0), footage_frames=f.n_frames
            )
            for name, f in footage.items()
        )
        rates = [f.fps for f in footage.values() if f.fps is not None]
    place = files or next(iter(paths.values()))
    return Session(place.parent, place.name, max(rates, default=1.0), n_frames, sources, ())


def plan_of_files(session: Session, files: Path, skeleton: Path | None = None) -> ImportPlan | MaskPlan:
    """Return the plan to import files of key points or masks, of which none is written.

    Raises:
        TrackerError: files cannot be read, or do not fit the footage.
    """
    plan = plan_import(session, ImportRequest(_PERSON, (files,), (_PERSON,), skeleton), calibrated=False)
    if plan.problems:
        kind = "masks" if isinstance(plan, MaskPlan) else "key points"
        raise CalibrationError(f"{plan.problems[0]}; correct the files of {kind}")
    _require_files({v.camera for v in plan.views if v.place is None}, files)
    return plan


def _require_files(without: Collection[str], files: Path) -> None:
    if without:
        raise CalibrationError(
            f"expected key points or masks of each camera, found none of {', '.join(sorted(without))} in {files}; add "
            "them, or leave out that footage"
        )


def silhouettes_in_masks(
    plan: MaskPlan, session: Session, cameras: Sequence[Camera], report: Report
) -> list[list[PersonSilhouette]]:
    """Measure the silhouettes of masks, by frame and camera.

    Args:
        plan: an import of masks.
        session: its cameras and frames.
        cameras: with their lenses, in the order of the session's.
        report: receives the progress.

    Raises:
        TrackerError: a mask is damaged.
    """
    out = [[NOTHING] * len(cameras) for _ in range(session.n_frames)]
    for v, (source, camera) in enumerate(zip(session.cameras, cameras, strict=True)):
        pictures = plan.pictures[camera.name]
        for i, picture in enumerate(pictures):
            report("reading masks", (v + i / len(pictures)) / len(cameras))
            k = int(picture) - source.offset
            if picture < 0 or not 0 <= k < session.n_frames:
                continue
            labels = np.unique(plan.masks[camera.name].read(i, source.camera.size).labels)
            if not plan.rules.is_matte and np.count_nonzero(labels) > 1:
                out[k][v] = PersonSilhouette(flaw=Flaw.SEVERAL)
                continue
            out[k][v] = _measured(parts_of_mask(plan.mask(camera.name, i, source.camera.size))[0] > 0, camera, 1.0)
    return out


def silhouettes_in_footage(session: Session, cameras: Sequence[Camera], report: Report) -> list[list[PersonSilhouette]]:
    """Find and measure silhouettes by subtracting the backgrounds that still cameras show, by frame and camera.

    Raises:
        RecordingError: footage cannot be read.
    """
    out = []
    with Recording(session.cameras) as recording, closing(SilhouetteFinder(session.cameras, recording)) as finder:
        for k in range(session.n_frames):
            report("finding silhouettes", k / session.n_frames)
            views = finder.silhouettes(k)
            found = zip(views, cameras, strict=True)
            out.append([_measured(v.mask, c, v.camera.size[0] / c.size[0]) for v, c in found])
    return out


def _measured(mask: Mask, camera: Camera, scale: float) -> PersonSilhouette:
    """Measure a silhouette in a mask that is smaller than the picture of a camera by a scale."""

    def original(points_px: Array) -> Array:
        return np.asarray((points_px + 0.5) / scale - 0.5)

    found = measure_silhouette(mask, lambda px: camera.undistort_points(original(px)))
    return found._replace(hull_px=original(found.hull_px), upright_px=original(found.upright_px))
