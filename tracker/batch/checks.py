"""Check a batch before it begins: each recording can be read, and its settings fit it. Nothing is written."""

from collections.abc import Callable, Collection
from pathlib import Path

from tracker.api.sessions import frames_of, open_session, people_of
from tracker.api.work import track_plan
from tracker.batch.plan import BatchPlan, PlannedRecording, Settings
from tracker.batch.table import Footage, Problem
from tracker.errors import TrackerError
from tracker.interchange.exports.formats import FORMATS
from tracker.interchange.observations.stored import list_observations
from tracker.session.assemble import check_parts
from tracker.session.frame_list import parse_frame_list
from tracker.session.relink import require_files
from tracker.session.session import Session


def problems(plan: BatchPlan, ended: Collection[str] = (), tick: Callable[[], None] = lambda: None) -> list[Problem]:
    """Return all problems: of the plan, of the rows of its table, and of each recording.

    Args:
        plan: of the batch.
        ended: names of recordings that are not tracked any more, and not checked.
        tick: called once for each recording.
    """
    found = [*plan.problems]
    for recording in plan.recordings:
        if recording.name not in ended:
            found += (Problem(recording.name, error) for error in _faults(recording))
        tick()
    return found


def _faults(recording: PlannedRecording) -> list[TrackerError]:
    """Return all reasons why a recording cannot be tracked with its settings."""
    settings, found = recording.settings, list[TrackerError]()
    for name in settings.export or ():
        if name not in FORMATS:
            found.append(TrackerError(f"expected formats among {', '.join(FORMATS)}, found '{name}'; correct 'export'"))
    try:
        session = _session(recording)
    except TrackerError as error:
        return [*found, error]
    everyone, stride = people_of(session, None), settings.stride or 1
    for check in (
        lambda: people_of(session, settings.people),
        lambda: frames_of(session, frames_to_track(settings, session)),
        lambda: track_plan(
            everyone, range(0, session.n_frames, stride), settings.method or "chamfer", settings.options, None
        ),
        lambda: _check_keypoints(settings.keypoints, session),
    ):
        try:
            check()
        except TrackerError as error:
            found.append(error)
    return found


def _session(recording: PlannedRecording) -> Session:
    """Return the session of a recording, or the one that its footage makes.

    Raises:
        TrackerError: it cannot be opened or made, or its footage is missing.
    """
    if recording.footage is None or Path(recording.session).is_dir():
        session = open_session(recording.session)
        require_files(session)
        return session
    _require_files(recording.footage)
    return check_parts(recording.footage.request(recording.session)).session


def _check_keypoints(name: str | None, session: Session) -> None:
    known = list_observations(session)
    if name is not None and name not in known:
        raise TrackerError(
            f"expected the name of imported observations as 'keypoints', among {', '.join(known) or 'none'}, found "
            f"'{name}'; import them, or correct it"
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
