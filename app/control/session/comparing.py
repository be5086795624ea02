"""Compare the poses of a frame before and after a fit or a search."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.control.session.session_state import SessionState
from app.state.comparison import ComparedWork, PoseComparison
from app.state.people import ShownPose
from app.state.state import Costs
from tracker.body.limbs import display_name
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array

_LEFT_M = 0.06
"""Distance from its placement at which a joint counts as left, metres. Fits of the samples stay below it with bodies of
the right size and placements off by 15 mm; with bodies an eighth too large or too small they exceed it."""
_RISE_SHARE, _RISE_PX = 0.15, 0.3
"""Rise of the cost of a view, or of a fit to pins, that counts, as a share and in px. It must exceed both."""
_WORSE_PX = 0.05
"""Rise of the mean cost that counts, px."""


class Comparing:
    """Shows the poses before the last fit or search. No stored pose changes, so nothing needs to be undone."""

    def __init__(self, session_state: SessionState) -> None:
        """Compare in this session.

        Args:
            session_state: holds the state.
        """
        self._session_state = session_state

    def show_before(self, shown: bool) -> None:
        """Show the poses before the last fit or search, or its result.

        Raises:
            TrackerError: the shown frame has no such result, or no longer.
        """
        session_state = self._session_state
        with session_state.lock:
            state, last = session_state.state, session_state.state.compared
            if last is None:
                if not shown:
                    return
                raise TrackerError(
                    "expected the result of a fit or search on this frame, found none or a changed one; "
                    "fit (G) or search (F) first"
                )
            if shown == last.is_before_shown:
                return
            if state.search.running or state.is_dragging:
                raise TrackerError("expected no search or drag in progress, found one; finish it first")
            view = replace(state.search_view, replay=None, preview=None)
            session_state.set(comparison=replace(last, is_before_shown=shown), search_view=view)

    def leave(self) -> None:
        """Show the present poses again; called under the lock before any change of them."""
        leave_before(self._session_state)


def leave_before(session_state: SessionState) -> None:
    """Show the result of the last fit or search, if the views show the poses before."""
    last = session_state.state.comparison
    if last is not None and last.is_before_shown:
        session_state.set(comparison=replace(last, is_before_shown=False))


def note_comparison(
    session_state: SessionState, work: ComparedWork, before: tuple[ShownPose, ...], costs: Costs, moved: Sequence[int]
) -> None:
    """Note that the shown poses are the result of a fit or a search.

    Args:
        session_state: holds the state, with the poses and costs after the work.
        work: the kind of work.
        before: each person before the work.
        costs: of the poses before the work.
        moved: indices of the people whom the work could move.
    """
    state, last = session_state.state, session_state.state.comparison
    goes_on = work == "search" and last is not None and last.before is before
    noted = PoseComparison(
        number=0 if last is None else last.number if goes_on else last.number + 1,
        frame=state.frame,
        work=work,
        before=before,
        after=state.poses,
        revisions=state.revisions,
        before_px=costs["cost_px"],
        before_view_costs_px=costs["view_costs_px"],
        after_px=state.cost_px,
        after_view_costs_px=state.view_costs_px,
    )
    session_state.set(comparison=replace(noted, warning=_warning(session_state, noted, moved)))


def _warning(session_state: SessionState, noted: PoseComparison, moved: Sequence[int]) -> str:
    """Return where the result disagrees with the user's placement or between views, as a sentence; empty if nowhere."""
    work, before_px, after_px = noted.work, noted.before_px, noted.after_px
    is_pinned = any(session_state.state.pins[person] for person in moved)
    # Pins are set where edges mislead: some rise of the cost is what they are for.
    if (
        before_px is not None
        and after_px is not None
        and (_is_much_more(before_px, after_px) if is_pinned else after_px > before_px + _WORSE_PX)
    ):
        why = ": pins and edges disagree; check the pins" if is_pinned else "; undo it"
        return f"The {work} raised the cost from {before_px:.2f} to {after_px:.2f} px{why}, or check the body's sizes."
    left = _farthest_left(session_state, noted, moved)
    if left is not None:
        joint, distance_m = left
        how = "lowered the cost but " if before_px is not None and after_px is not None else ""
        return (
            f"The {work} {how}left the {joint} {100 * distance_m:.0f} cm from where you placed it; "
            "compare both poses, and check the body's sizes."
        )
    risen = _most_risen(noted)
    if risen is not None:
        index, was, now = risen
        name = session_state.session.cameras[index].camera.name
        return (
            f"The {work} lowered the mean cost but raised that of {name} from {was:.2f} to {now:.2f} px; "
            "check the body's sizes and the calibration of this camera."
        )
    return ""


def _farthest_left(
    session_state: SessionState, noted: PoseComparison, moved: Sequence[int]
) -> tuple[str, float] | None:
    """Return the placed joint that was left farthest behind, and by how many metres; None if none was left.

    Pins count, and the held joints of a pose set by hand. A joint that was placed in a view is measured across the line
    of sight of that view, because its depth was not placed.
    """
    state, found = session_state.state, list[tuple[float, str]]()
    cameras = [c.camera for c in session_state.session.cameras]
    for person in moved:
        model = state.models[person]
        was, now = (model.points_world(v) for v in (noted.before[person].values, noted.after[person]))
        for pin in state.pins[person]:
            camera, i = cameras[pin.camera].pinhole, model.point_names.index(pin.point)
            pinned = camera.back_project(np.array(pin.position_px), float(camera.depths(now[i])))
            found.append((float(np.linalg.norm(now[i] - pinned)), pin.point))
        if noted.before[person].source != "manual":
            continue
        for held in state.held:
            if (held.frame, held.person) == (noted.frame, person):
                i = model.point_names.index(held.point)
                eye = None if held.camera is None else cameras[held.camera].center_world
                found.append((_across(was[i], now[i], eye), held.point))
    distance_m, point = max(found, default=(0.0, ""))
    return (display_name(point), distance_m) if distance_m > _LEFT_M else None


def _across(was: Array, now: Array, eye: Array | None) -> float:
    """Return the distance between two points, metres; seen from an eye, that between its lines of sight."""
    if eye is None:
        return float(np.linalg.norm(now - was))
    sight = (was - eye) / max(1e-9, float(np.linalg.norm(was - eye)))
    off = now - eye
    return float(np.linalg.norm(off - (off @ sight) * sight))


def _is_much_more(was_px: float, now_px: float) -> bool:
    return now_px > was_px + _RISE_PX and now_px > (1 + _RISE_SHARE) * was_px


def _most_risen(noted: PoseComparison) -> tuple[int, float, float] | None:
    """Return the view whose cost rose most by share, and its costs before and after, px; None if none rose by much."""
    risen = [
        (now / max(1e-9, was), i, was, now)
        for i, (was, now) in enumerate(zip(noted.before_view_costs_px, noted.after_view_costs_px, strict=False))
        if was is not None and now is not None and _is_much_more(was, now)
    ]
    return max(risen)[1:] if risen else None
