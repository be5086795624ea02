"""Compare the poses of a frame before and after a fit or a search."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from app.control.session.session_state import SessionState
from app.state.comparison import ComparedWork, PoseComparison
from app.state.people import ShownPose
from app.state.state import Costs
from tracker.body.limbs import display_name
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.initialization.silhouette_check import check_all_people
from tracker.estimation.posing.limb_moves import LimbMove, untouched_moves
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation

_Placed = Mapping[str, Sequence[PointObservation]]
"""Points that the user has placed, with where in which views."""
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
                    "fit or search first"
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
    """Note that the shown poses are the result of a fit or a search; called before it is saved.

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
        before_px=costs.cost_px,
        before_view_costs_px=costs.view_costs_px,
        after_px=state.cost_px,
        after_view_costs_px=state.view_costs_px,
    )
    placed = {person: _placed_points(session_state, person, before[person].values) for person in moved}
    if work == "fit":
        bodies = [PosedBody(m, p.values) for m, p in zip(state.models, state.people, strict=True)]
        filled = check_all_people(bodies, session_state.frames.cached_evidence(state.frame) or ())
        noted = replace(noted, moved=_untouched_moves(session_state, noted, placed), filled=filled)
    session_state.set(comparison=replace(noted, warning=_warning(session_state, noted, placed)))


def _placed_points(session_state: SessionState, person: int, before: Array) -> dict[str, list[PointObservation]]:
    """Return the points of a person that the user has placed, with where; nowhere if a point was held by command.

    Args:
        session_state: holds the state.
        person: index of the person.
        before: the pose before the work, (n_values,).
    """
    state, model = session_state.state, session_state.models[person]
    held = [h for h in state.held if (h.frame, h.person) == (state.frame, person)]
    names = {h.point for h in held}
    marks = [*state.pins[person], *(at for at in session_state.fit_constraints(person).seen if at.point in names)]
    found = {name: [at for at in marks if at.point == name] for name in names | {at.point for at in marks}}
    points_world = model.points_world(before)
    for point, camera in {(h.point, h.camera) for h in held if not found[h.point]}:
        if camera is not None:  # where it was put is not stored any more
            u, v = session_state.session.cameras[camera].camera.pinhole.project(
                points_world[model.point_names.index(point)]
            )
            found[point].append(PointObservation(point, camera, (float(u), float(v))))
    return found


def _untouched_moves(
    session_state: SessionState, noted: PoseComparison, placed: Mapping[int, Mapping[str, object]]
) -> tuple[tuple[int, LimbMove], ...]:
    """Return the limbs that a fit moved although nobody had touched them.

    This concerns people of whom the user has placed something else: a fit of a whole body is meant to move its limbs.
    """
    found = [
        (person, move)
        for person, points in placed.items()
        if points
        for move in untouched_moves(
            session_state.models[person], noted.before[person].values, noted.after[person], points.keys()
        )
    ]
    return tuple(sorted(found, key=lambda one: -one[1].distance_m))


def _warning(session_state: SessionState, noted: PoseComparison, placed: Mapping[int, _Placed]) -> str:
    """Return where the result disagrees with the user's placement or between views, as a sentence; empty if nowhere."""
    work, before_px, after_px = f"{noted.work}{_whose(session_state, placed)}", noted.before_px, noted.after_px
    is_pinned = any(session_state.state.pins[person] for person in placed)
    # Pins are set where edges mislead: some rise of the cost is what they are for.
    if (
        before_px is not None
        and after_px is not None
        and (_is_much_more(before_px, after_px) if is_pinned else after_px > before_px + _WORSE_PX)
    ):
        why = ": pins and edges disagree; check the pins" if is_pinned else "; undo it"
        return f"The {work} raised the cost from {before_px:.2f} to {after_px:.2f} px{why}, or check the body's sizes."
    left = _farthest_left(session_state, noted, placed)
    if left is not None:
        person, joint, distance_m = left
        how = "lowered the cost but " if before_px is not None and after_px is not None else ""
        return (
            f"The {noted.work} {how}left the {joint}{_whose(session_state, [person])} {100 * distance_m:.0f} cm from "
            "where you placed it; compare both poses, and check the body's sizes."
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


def _whose(session_state: SessionState, people: Iterable[int]) -> str:
    """Return " of NAME", with the names of some people; empty where there is only one person."""
    everybody = session_state.session.people
    names = " and ".join(everybody[person].name for person in people)
    return f" of {names}" if names and len(everybody) > 1 else ""


def _farthest_left(
    session_state: SessionState, noted: PoseComparison, placed: Mapping[int, _Placed]
) -> tuple[int, str, float] | None:
    """Return the placed joint that was left farthest behind, its person and by how many metres; None if none was left.

    A joint is measured from where the user put it in each view, across the line of sight, because its depth was not
    placed. It may have been moved by later drags. One that was held by command is measured from where it was.
    """
    found = list[tuple[float, str, int]]()
    cameras = [c.camera.pinhole for c in session_state.session.cameras]
    for person, points in placed.items():
        model = session_state.state.models[person]
        was, now = (model.points_world(v) for v in (noted.before[person].values, noted.after[person]))
        for point, marks in points.items():
            i = model.point_names.index(point)
            places = [cameras[at.camera].back_project(np.array(at.position_px), 1.0) for at in marks]
            eyes = [cameras[at.camera].center_world for at in marks]
            off = [_across(place, now[i], eye) for place, eye in zip(places, eyes, strict=True)]
            found.append((max(off, default=_across(was[i], now[i], None)), point, person))
    distance_m, point, person = max(found, default=(0.0, "", 0))
    return (person, display_name(point), distance_m) if distance_m > _LEFT_M else None


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
