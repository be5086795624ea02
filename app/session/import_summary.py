"""Describe an import that has been read and checked."""

from collections.abc import Callable
from typing import Any

from tracker.errors import TrackerError
from tracker.interchange.observations.plans import ImportPlan, MaskPlan
from tracker.session.session import Session


def import_summary(
    session: Session, plan: ImportPlan | MaskPlan, text: Callable[[TrackerError], str]
) -> dict[str, Any]:
    """Return which views, frames and points an import has, and what contradicts the session, as JSON values.

    Args:
        session: the session.
        plan: the import.
        text: phrases a problem, for the command line or for the page.
    """
    return {
        **(_of_masks(session, plan) if isinstance(plan, MaskPlan) else _of_points(plan)),
        "frames": session.n_frames,
        "views": [
            {
                "view": v.camera,
                "place": str(v.place) if v.place is not None else None,
                "rows": v.n_rows,
                "frames": list(v.frames) if v.frames is not None else None,
                "most_people": v.n_people,
                "confidence": v.confidence,
                "share": v.share,
            }
            for v in plan.views
        ],
        "problems": [text(p) for p in plan.problems],
    }


def _of_points(plan: ImportPlan) -> dict[str, Any]:
    found = plan.observations
    body_points = {points for points in found.counterparts.values() if points}
    return {
        "name": found.name,
        "format": found.format,
        "are_masks": False,
        "people": list(found.people),
        "skeleton": found.joint_map.name,
        "points": {name: list(points) for name, points in found.counterparts.items()},
        "matched": len(body_points),
        "notes": list(found.notes),
    }


def _of_masks(session: Session, plan: MaskPlan) -> dict[str, Any]:
    """Describe masks; they are of the people whom their values tell apart."""
    return {
        "name": plan.name,
        "format": plan.format,
        "are_masks": True,
        "people": [session.people[number - 1].name for number in (plan.rules.people or {}).values()],
        "skeleton": "",
        "points": {},
        "matched": 0,
        "notes": list(plan.notes),
    }
