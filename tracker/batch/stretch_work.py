"""Begin a long recording, and track one of its stretches in a copy of its session.

Workers never write one store at the same time: each stretch has a copy of the session with the people's final bodies.
In that it is tracked like a recording of its own, out from a frame on which everybody has a pose or is found.
"""

import secrets
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from tracker.api.sessions import open_session, opened, people_of
from tracker.api.work import Progress, ProgressSink, Tracked, track_plan, tracked_of
from tracker.batch.plan import Settings
from tracker.batch.stretches import Division, RecordingStretch, divide
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.initialization.first_pose import FirstPoses
from tracker.estimation.initialization.frame_trials import find_first_poses
from tracker.estimation.initialization.generators.start_generators import GENERATORS
from tracker.formats.model_toml import format_model
from tracker.interchange.observations.stored import FOLDER as OBSERVATIONS
from tracker.interchange.observations.stored_masks import list_masks
from tracker.pipeline.automatic_run import ChainPlan, StoredSession, find_and_acquire, find_and_track
from tracker.pipeline.find_people import FindSettings, find_people, frames_to_try
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import CALIBRATION_FILE, Session, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.backups import copy_store

FOUND = "found"
"""Setting of a copy: whether its people were found in this stretch, so that their names are not sure."""


def begin(session: Session, settings: Settings, frames: range, progress: Progress) -> Division:
    """Find the people of a long recording, acquire their sizes, and cut it into stretches.

    Args:
        session: of the recording; first poses and bodies are stored in it.
        settings: of the recording.
        frames: to track.
        progress: receives the progress.

    Raises:
        TrackerError: see `find_and_acquire`.
    """
    people = people_of(session, settings.people)
    with opened(session) as stored:
        find = None if settings.find is False else FindSettings(keypoints=settings.keypoints)
        chain = ChainPlan(plan_of(settings, people, frames), find, () if settings.acquire is False else people)
        plan = find_and_acquire(chain, stored, ProgressSink(progress))
    assert plan.start is not None
    with AnnotationStore(session.annotations_path, read_only=True) as store:
        of_all = [{row.frame for row in store.frames(session.people[i].name) if row.keyframe} for i in plan.people]
    cuts = divide(frames, set.intersection(*of_all), settings.stretch_frames, session.fps)
    return Division((frames.start, frames.stop, frames.step), plan.people, plan.start, cuts)


def track_stretch(
    session: Session,
    folder: Path,
    settings: Settings,
    division: Division,
    stretch: RecordingStretch,
    progress: Progress,
) -> Tracked:
    """Track a stretch. One that was interrupted goes on where it was.

    Args:
        session: of the recording, which stays as it is.
        folder: of the copy, which is made if there is none.
        settings: of the recording.
        division: of the recording.
        stretch: one of its stretches.
        progress: receives the progress.

    Raises:
        TrackerError: the people are not found in it.
    """
    frames = range(stretch.first, stretch.last + 1, division.range.step)
    with opened(_copy(session, folder)) as stored:
        _place(stored, division.people, frames, stretch.names, settings.keypoints, progress)
        find_and_track(ChainPlan(plan_of(settings, division.people, frames), None), stored, ProgressSink(progress))
        return tracked_of(stored)


def plan_of(settings: Settings, people: tuple[int, ...], frames: range) -> TrackPlan:
    """Return the plan of tracking with the settings of a recording."""
    return track_plan(people, frames, settings.method or "chamfer", settings.options, settings.keypoints)


def _copy(session: Session, folder: Path) -> Session:
    """Return the copy of a session in a folder. It appears as a whole."""
    if folder.is_dir():
        return open_session(folder)
    for left in folder.parent.glob(f".{folder.name}.*.tmp"):  # of a worker that died
        shutil.rmtree(left, ignore_errors=True)
    temporary = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.tmp")
    copy = replace(session, folder=temporary)
    save_session(copy)
    with suppress(FileNotFoundError):  # to the bit: writing rounds
        shutil.copyfile(session.folder / CALIBRATION_FILE, temporary / CALIBRATION_FILE)
    copy_store(session.annotations_path, copy.annotations_path)
    if (session.folder / OBSERVATIONS).is_dir():
        masks = {session.folder / OBSERVATIONS / name for name in list_masks(session)}  # used where they are
        shutil.copytree(
            session.folder / OBSERVATIONS,
            temporary / OBSERVATIONS,
            ignore=lambda at, names: names if Path(at) in masks else [],
        )
    temporary.rename(folder)
    return open_session(folder)


def _place(
    stored: StoredSession,
    people: tuple[int, ...],
    frames: range,
    names: Sequence[int],
    keypoints: str | None,
    progress: Progress,
) -> None:
    """Find people in a stretch that has no frame on which all have a pose."""
    sources = [stored.sources(i) for i in people]
    if any(all(k in own for own in sources) for k in frames):
        return
    first_poses = _find(stored, people, frames, keypoints, progress)
    poses = {}
    for i, other in zip(people, names or range(len(people)), strict=True):
        named, first = people[other], first_poses.poses[i]
        model = stored.session.people[named].model
        if format_model(first.model) != format_model(model):  # a body keeps the size that it has in the whole recording
            body = PosedBody(model, retarget_pose(first.start.pose, first.model, model))
            first = first._replace(start=replace(first.start, body=body))
        poses[named] = first
    stored.store_found(FirstPoses(first_poses.frame, poses))
    stored.store_setting(FOUND, True)


def _find(
    stored: StoredSession, people: tuple[int, ...], frames: range, keypoints: str | None, progress: Progress
) -> FirstPoses:
    """Find people whose bodies are known: one good frame is enough, because no height has to be confirmed."""
    session, observer = stored.session, stored.observer
    cheapest = next(iter(GENERATORS))
    tried = frames_to_try(frames, None) if keypoints is None else []
    for frame in tried:
        progress("finding first poses", 0.0)
        with suppress(TrackerError):
            first_poses = find_first_poses(
                session, observer, people, [frame], (cheapest,), say=lambda text: progress("finding first poses", 0.0)
            )
            if first_poses.is_good:
                return first_poses
    sink = ProgressSink(progress)
    return find_people(session, observer, people, frames, FindSettings(keypoints=keypoints), sink.report, sink.show)
