"""Check a batch before it begins: each recording can be read, and its settings fit it. Nothing is written."""

from collections.abc import Callable, Collection
from pathlib import Path

from tracker.api.sessions import frames_of, open_session, people_of
from tracker.api.work import track_plan
from tracker.batch.plan import BatchPlan, PlannedRecording, Settings
from tracker.batch.table import Footage, Problem
from tracker.errors import TrackerError
from tracker.exports.formats import FORMATS
from tracker.observations.stored import list_observations
from tracker.session.assemble import check_parts
from tracker.session.frame_list import parse_frame_list
from tracker.session.relink import require_files
from tracker.session.session import Session


def problems(plan: BatchPlan, ended: Collection[str] = (), tick: Callable[[], None] = lambda: None) -> list[Problem]:
    """Return a problem for each recording that cannot be tracked, and for each row of the table that cannot be read.

    Args:
        plan: of the batch.
        ended: names of recordings that are not tracked any more, and not checked.
        tick: called once for each recording.
    """
    found = [*plan.problems]
    for recording in plan.recordings:
        try:
            if recording.name not in ended:
                _check(recording)
        except TrackerError as error:
            found.append(Problem(recording.name, error))
        tick()
    return found


def _check(recording: PlannedRecording) -> None:
    """Check a recording with its settings.

    Raises:
        TrackerError: its session cannot be opened or made, its footage is missing, or a setting does not fit.
    """
    settings = recording.settings
    for name in settings.export or ():
        if name not in FORMATS:
            raise TrackerError(f"expected formats among {', '.join(FORMATS)}, found '{name}'; correct 'export'")
    if recording.footage is None or Path(recording.session).is_dir():
        session = open_session(recording.session)
        require_files(session)
    else:
        _require_files(recording.footage)
        session = check_parts(recording.footage.request(recording.session)).session
    people = people_of(session, settings.people)
    frames = frames_of(session, frames_to_track(settings, session))[:: settings.stride or 1]
    track_plan(people, frames, settings.method or "chamfer", settings.options, settings.keypoints)
    known = list_observations(session)
    if settings.keypoints is not None and settings.keypoints not in known:
        raise TrackerError(
            f"expected the name of imported observations as 'keypoints', among {', '.join(known) or 'none'}, found "
            f"'{settings.keypoints}'; import them, or correct it"
        )


def _require_files(footage: Footage) -> None:
    """Check that the files of a row are there.

    Raises:
        TrackerError: some are not.
    """
    paths = (footage.calibration, *footage.videos, *([footage.background] if footage.background else []))
    if missing := [path for path in paths if not Path(path).exists()]:
        raise TrackerError(
            f"expected files and folders that exist, found none at {', '.join(missing)}; correct the path"
        )


def frames_to_track(settings: Settings, session: Session) -> list[int] | None:
    """Return the frames that settings name; None for all.

    Raises:
        TrackerError: they are not frames of the session.
    """
    return None if settings.frames is None else list(parse_frame_list(settings.frames, session.n_frames, "frames"))
