"""Tell on which frames a tracking run is better or worse than the poses that it replaced."""

from collections.abc import Sequence
from dataclasses import replace

from app.state.comparison import ComparedPose, Stretch, Verdict
from tracker.pipeline.methods import METHODS

_SAME_MM = 10.0
"""Largest distance between the joints of two poses that count as the same, mm: smoothing moves them by as much."""
_SAME_SHARE = 0.03
"""Costs that differ by less are as good as each other. Starts of a track are ambiguous below it, too."""
_GAP = 3
"""Largest number of frames between two parts of a stretch in which neither pose is better."""
_BADNESS = {"good": 0, "doubtful": 1, "lost": 2}


def verdict(pose: ComparedPose) -> Verdict:
    """Judge a pose against the one that it replaced: by the statuses, or by the costs where these agree.

    Costs of poses that were made by hand say nothing here: they were measured against other edges than a tracker's.
    """
    if pose.farthest_mm < _SAME_MM:
        return "same"
    now, other = _BADNESS.get(pose.status), _BADNESS.get(pose.other_status)
    if now is not None and other is not None and now != other:
        return "better" if now < other else "worse"
    is_tracked = pose.method in METHODS and pose.other_method in METHODS
    if not is_tracked or pose.cost_px is None or pose.other_cost_px is None:
        return "same"
    if abs(pose.cost_px - pose.other_cost_px) <= _SAME_SHARE * max(pose.cost_px, pose.other_cost_px):
        return "same"
    return "better" if pose.cost_px < pose.other_cost_px else "worse"


def stretches(person: int, poses: Sequence[ComparedPose]) -> tuple[Stretch, ...]:
    """Return the stretches of frames on which the present poses of a person are better or worse, ascending.

    Args:
        person: index of the person.
        poses: of the person, by ascending frame.
    """
    found: list[Stretch] = []
    for pose in poses:
        kind = verdict(pose)
        last = found[-1] if found else None
        if kind == "same":
            continue
        if last is not None and last.verdict == kind and pose.frame - last.last <= _GAP + 1:
            found[-1] = replace(last, last=pose.frame, frames=last.frames + 1)
        else:
            found.append(Stretch(person, pose.frame, pose.frame, 1, kind))
    return tuple(found)
