"""Describe an import that has been read and checked."""

from collections.abc import Callable
from typing import Any

from tracker.errors import TrackerError
from tracker.observations.importing import ImportPlan
from tracker.session.session import Session


def import_summary(session: Session, plan: ImportPlan, text: Callable[[TrackerError], str]) -> dict[str, Any]:
    """Return which views, frames and points an import has, and what contradicts the session, as JSON values.

    Args:
        session: the session.
        plan: the import.
        text: phrases a problem, for the command line or for the page.
    """
    found = plan.observations
    body_points = {points for points in found.counterparts.values() if points}
    return {
        "name": found.name,
        "format": found.format,
        "people": list(found.people),
        "frames": session.n_frames,
        "views": [
            {
                "view": v.camera,
                "place": str(v.place) if v.place is not None else None,
                "rows": v.n_rows,
                "frames": list(v.frames) if v.frames is not None else None,
                "most_people": v.n_people,
                "confidence": v.confidence,
            }
            for v in plan.views
        ],
        "skeleton": found.joint_map.name,
        "points": {name: list(points) for name, points in found.counterparts.items()},
        "matched": len(body_points),
        "notes": list(found.notes),
        "problems": [text(p) for p in plan.problems],
    }
