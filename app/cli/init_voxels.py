"""`quadrille init --method voxels` and `auto`: a first pose with nobody's help."""

from contextlib import closing
from typing import Any

from app.cli.target import Target
from app.runtime.progress import Reporter

AUTO_FRAMES = 5
"""Number of frames that `auto` tries."""


def auto_frames(frame: int, n_frames: int) -> list[int]:
    """Return the frames that `auto` tries: the given one first, the others spread over the recording."""
    last = n_frames - 1
    spread = [round(i * last / (AUTO_FRAMES - 1)) for i in range(AUTO_FRAMES)]
    return [frame, *sorted({k for k in spread if k != frame})][:AUTO_FRAMES]


def init_from_voxels(at: Target, frames: list[int], voxel_m: float, method: str, progress: Reporter) -> dict[str, Any]:
    """Find the pose of one person from voxels, on the best of some frames, and store it.

    Args:
        at: the session and the person.
        frames: frames to try.
        voxel_m: edge of a voxel, metres.
        method: `voxels` or `auto`, for the history.
        progress: says what was tried.

    Returns:
        `person`, `frame`, `height_m`, `status`, `cost_px`, `unresolved`, `straight`, `facing_sure`, `notes`.

    Raises:
        TrackerError: no frame shows the person well enough; nothing is stored then.
    """
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.pipeline.first_pose import find_first_pose, store_first_pose
    from tracker.session.lock import SessionLock
    from tracker.session.relink import require_files
    from tracker.store.annotation_store import AnnotationStore

    session, (person,) = at
    require_files(session)
    with SessionLock(session.folder), Recording(session.cameras) as recording:
        observer = Observer(session.cameras, recording)
        found = find_first_pose(session, observer, person, frames, voxel_m, progress.say)
        with closing(AnnotationStore(session.annotations_path)) as store:
            store_first_pose(session, store, person, found, method)
    return {
        "person": session.people[person].name,
        "frame": found.frame,
        "height_m": found.model.height_m,
        "status": found.fitted.status,
        "cost_px": found.fitted.cost_px,
        "unresolved": list(found.parts.unresolved),
        "straight": list(found.parts.straight),
        "facing_sure": found.parts.is_facing_sure,
        "notes": list(found.notes),
    }


def format_found(found: dict[str, Any]) -> str:
    """Format the result for a terminal."""
    head = f"{found['person']}, {found['height_m']:.2f} m tall, frame {found['frame']}: {found['status']}, "
    return "\n".join([f"{head}cost {found['cost_px']:.2f} px", *(f"note: {note}" for note in found["notes"])])
