"""`quadrille init --method voxels`, `axis` and `auto`: automatic first poses."""

from typing import TYPE_CHECKING, Any

from app.cli.target import Target
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.initialization.first_pose import FirstPoses
    from tracker.session.session import Session


def init_from_silhouettes(
    at: Target, method: str, frame: int, voxel_m: float, only_unplaced: bool, progress: Reporter
) -> dict[str, Any]:
    """Find the poses of people on one frame, and store them as one entry of the history.

    Args:
        at: the session and the people.
        method: `voxels`, `axis` or `auto`.
        frame: frame to set; with `auto` the first one to try.
        voxel_m: edge of a voxel, metres.
        only_unplaced: whether people who have a pose keep it.
        progress: says what was tried.

    Returns:
        `frame` and `people`, a list of `person`, `method`, `height_m`, `status`, `cost_px`, `facing_sure`,
        `notes`.

    Raises:
        TrackerError: everybody has a pose, or no frame shows the people well enough; nothing is stored then.
    """
    from tracker.pipeline.chain import open_stored_session, unplaced
    from tracker.pipeline.find_people import FindSettings, find_people

    def report(stage: str, share: float, text: str = "", /) -> None:
        if text:
            progress.say(text)

    session = at.session
    with open_stored_session(session) as opened:
        people = unplaced(opened, at.people) if only_unplaced else at.people
        if not people:
            raise TrackerError(
                "expected a person without a pose, found none; name one with --person to find the person again"
            )
        settings = FindSettings(frame, None if method == "auto" else method, voxel_m)
        first = find_people(session, opened.observer, people, range(session.n_frames), settings, report)
        opened.store_found(first, f"init from {method}")
    return first_poses_record(session, first)


def first_poses_record(session: "Session", first: "FirstPoses") -> dict[str, Any]:
    """Return what `init_from_silhouettes` returns."""
    people = [
        {
            "person": session.people[i].name,
            "method": p.start.source,
            "height_m": p.model.height_m,
            "status": p.status,
            "cost_px": p.cost_px,
            "facing_sure": p.is_facing_sure,
            "notes": list(p.notes),
        }
        for i, p in first.poses.items()
    ]
    return {"frame": first.frame, "people": people}


def format_first_poses(found: dict[str, Any]) -> str:
    """Format the result for a terminal."""
    lines = []
    for own in found["people"]:
        head = f"{own['person']}, {own['height_m']:.2f} m tall, frame {found['frame']}, by {own['method']}: "
        lines.append(f"{head}{own['status']}, cost {own['cost_px']:.2f} px")
        lines += [f"note: {note}" for note in own["notes"]]
    return "\n".join(lines)
