"""Set, move and remove pins, and fit people to them. Each gesture is one entry of the history."""

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.control.posing.depth_check import note_unseen_depth
from app.control.session.activities import Activities
from app.control.session.comparing import note_comparison
from app.control.session.frame_poses import Pins
from app.control.session.session_state import SessionState
from app.state.people import ShownPose
from tracker.body.limbs import display_name, limb_display_name
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.posing.edits import copy_dofs, limb_of
from tracker.estimation.posing.pinned_fit import fit_frame
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation

_CHECKPOINT_S = 1.0
"""A long drag of a pin is saved at least this often."""


@dataclass(frozen=True, eq=False)
class _PinDrag:
    """A pin that is being dragged."""

    page: int
    """Number of the page that drags it."""
    person: int
    point: str
    camera: int
    pins: Pins
    """The pins of all people before the gesture."""
    people: tuple[ShownPose, ...]
    """All people before the gesture. Each fit starts from them, so that it depends on the pin's position only."""
    live: bool
    """Whether the body is fitted while the pin moves."""


class Pinning:
    """The pins of the shown frame; at most one is dragged."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Drag no pin yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities
        self._drag: _PinDrag | None = None
        activities.add_gesture(self.finish)

    def begin(
        self, page: int, frame: int, camera: int, person: int, point: str, position_px: tuple[float, float], live: bool
    ) -> None:
        """Set a pin, or grab the one that the point has in this view.

        Args:
            page: number of the page.
            frame: the frame that the user saw, which a tracker may have left.
            camera: index of the view.
            person: index of the person.
            point: name of the point.
            position_px: its position, undistorted px.
            live: whether the body is fitted while the pin moves.

        Raises:
            TrackerError: the position is outside of the image.
        """
        session = self._session_state.session
        if not (0 <= frame < session.n_frames and 0 <= camera < len(session.cameras)):
            return
        models = self._session_state.models
        if not (0 <= person < len(models) and point in models[person].point_names):
            return
        source = session.cameras[camera].camera
        if not _is_shown(source, position_px):
            width, height = source.pinhole.size
            raise TrackerError(
                f"expected a pin within the {width}x{height} px of {source.name}, found it at "
                f"({position_px[0]:.0f}, {position_px[1]:.0f}); set it where the image shows the joint"
            )
        with self._activities.editing():
            self._session_state.go_to(frame)
            self._session_state.require_editable([person])
            state = self._session_state.state
            self._drag = _PinDrag(page, person, point, camera, state.pins, state.people, live)
            self._session_state.last_save = time.monotonic()
            pins = _with_pin(state.pins, person, PointObservation(point, camera, position_px))
            self._session_state.set(person=person, point=point, pins=pins, is_pin_held=True)

    def move(self, page: int, position_px: tuple[float, float]) -> None:
        """Move the dragged pin, at most to the border of the image, and fit the body if the pin is live."""
        with self._session_state.lock:
            drag = self._drag
            if drag is None or page != drag.page:
                return
            source = self._session_state.session.cameras[drag.camera].camera
            position_px = _clipped(position_px, source.pinhole.size)
            if not _is_shown(source, position_px):
                return
            before = self._session_state.state.pins
            pins = _with_pin(before, drag.person, PointObservation(drag.point, drag.camera, position_px))
            if pins == before:
                return  # a click only sets it
            if drag.live:
                self._show_fit([drag.person], [drag.person], drag.people, pins)
            else:
                self._session_state.set(pins=pins)
            if time.monotonic() - self._session_state.last_save > _CHECKPOINT_S:
                self._save(drag)

    def end(self, page: int) -> None:
        """Release the pin; the gesture is one entry of the history, on disk when this returns."""
        with self._session_state.lock:
            if self._drag is not None and page == self._drag.page:
                self.finish()

    def cancel(self, page: int) -> None:
        """Release the pin and restore pins and body before the gesture."""
        with self._session_state.lock:
            drag = self._drag
            if drag is None or page != drag.page:
                return
            self._drag = None
            self._session_state.revert(drag)

    def finish(self) -> None:
        """End the drag of a pin, if there is one, and save it; called under the lock."""
        drag = self._drag
        if drag is None:
            return
        self._save(drag)
        self._drag = self._session_state.open_edit_owner = None
        self._session_state.set(is_pin_held=False)
        note_unseen_depth(self._session_state, drag.person, drag.point)

    def remove(self, frame: int, person: int, point: str | None = None, camera: int | None = None) -> None:
        """Remove pins of a person on a frame: of one point, in one view, or all; one entry of the history."""
        if not (0 <= frame < self._session_state.session.n_frames and 0 <= person < len(self._session_state.models)):
            return
        with self._activities.editing():
            self._session_state.go_to(frame)
            pins = list(self._session_state.state.pins)
            pins[person] = tuple(
                p for p in pins[person]
                if not ((point is None or p.point == point) and (camera is None or p.camera == camera))
            )  # fmt: skip
            if len(pins[person]) == len(self._session_state.state.pins[person]):
                return
            self._session_state.set(pins=tuple(pins))
            what = "remove all pins" if point is None else f"remove pin {display_name(point)}{self._in(camera)}"
            self._session_state.save(what, "manual", None, person)

    def fit(self, frame: int, person: int | None = None, point: str | None = None) -> None:
        """Fit people to pins and edges together.

        It vouches for those with pins on the frame; without any, for the selected person.

        Args:
            frame: the frame that the user saw.
            person: index of the only person to fit; by default the selected person and all who have a pose or pins on
                the frame.
            point: name of a point of this person whose limb alone is fitted; None fits the whole body.

        Raises:
            TrackerError: the frame has neither pins nor, yet, edges.
        """
        if not 0 <= frame < self._session_state.session.n_frames:
            return
        with self._activities.editing():
            self._session_state.go_to(frame)
            state = self._session_state.state
            views = self._session_state.frames.cached_evidence(frame)
            placed = [i for i, shown in enumerate(state.people) if shown.source is not None or state.pins[i]]
            meant = {state.person, *placed} if person is None else {person}
            pinned = sorted(i for i in meant if state.pins[i])
            if views is None and not pinned:
                raise TrackerError(
                    "expected pins or edges to fit to, found no pin on this frame and its edges not there yet; "
                    "set pins, or try again in a moment"
                )
            people = sorted(meant) if views is not None else pinned
            vouched = people if person is not None else pinned or [state.person]
            limb, dofs = ("", None) if person is None or point is None else limb_of(state.models[person], point)
            costs = self._session_state.costs(state.poses)
            self._show_fit(people, vouched, state.people, state.pins, dofs)
            note_comparison(self._session_state, "fit", state.people, costs, people)
            evidence = " and ".join([*(["pins"] if pinned else []), *(["edges"] if views is not None else [])])
            what = f"fit {limb_display_name(limb)}" if limb else "fit"
            self._session_state.save(f"{what} to {evidence}", "fitted", None, person, vouched)

    def take_limb_back(self, frame: int, every: bool = False) -> None:
        """Put the limb back that the last fit moved farthest although nobody had touched it; all else stays.

        Args:
            frame: the frame that the user saw.
            every: whether to put all such limbs back.

        Raises:
            TrackerError: the shown pose is not the result of a fit that moved such a limb.
        """
        with self._activities.editing():
            session_state = self._session_state
            session_state.go_to(frame)
            last = session_state.state.compared
            if last is None or not last.moved:
                raise TrackerError(
                    "expected a limb that the last fit moved although nobody had touched it, found none; "
                    "undo takes back the whole fit"
                )
            moves = last.moved if every else last.moved[:1]
            for person, move in moves:
                former, now = last.before[person].values, session_state.state.poses[person]
                session_state.show_pose(person, copy_dofs(session_state.models[person], now, former, move.limb.dofs))
            state = session_state.state
            noted = replace(
                last, after=state.poses, after_px=state.cost_px, after_view_costs_px=state.view_costs_px,
                moved=last.moved[len(moves) :], is_before_shown=False,
            )  # fmt: skip
            session_state.set(comparison=noted)
            names = " and ".join(limb_display_name(move.limb.name) for _, move in moves)
            people = {person for person, _ in moves}
            session_state.save(f"take back {names}", "manual", None, people.pop() if len(people) == 1 else None)

    def _show_fit(
        self,
        fitted: Iterable[int],
        vouched: Sequence[int],
        start: tuple[ShownPose, ...],
        pins: Pins,
        dofs: NDArray[np.bool_] | None = None,
    ) -> None:
        """Fit some people, with all others fixed, and show them.

        Args:
            fitted: indices of the people to fit.
            vouched: indices of those whom the fit is about. Doubts about others stay.
            start: from which the fit starts, all people.
            pins: of all people.
            dofs: the only degrees of freedom that may change, (n_dofs,); None for all that are not locked.
        """
        session_state = self._session_state
        fitted = list(fitted)
        views = session_state.frames.cached_evidence(session_state.state.frame)
        cameras = [c.camera for c in session_state.session.cameras]
        constraints = [session_state.fit_constraints(person) for person in range(len(session_state.models))]
        if dofs is not None:
            constraints = [replace(c, active_dofs=session_state.active_dofs(i) & dofs) if i in fitted else c
                           for i, c in enumerate(constraints)]  # fmt: skip
        state, moving = session_state.state, map(session_state.state.velocity, range(len(start)))
        bodies = [*map(PosedBody, session_state.models, (p.values for p in start), moving)]
        found = fit_frame(bodies, self._timed(pins), cameras, views, state.settings, fitted, constraints)
        people = list(start)
        for person in fitted:
            free = session_state.free_sources(person, "fitted")
            if views is None or dofs is not None:  # only what moved was fitted
                free = tuple(
                    s if moved else ""
                    for s, moved in zip(free, found.poses[person] != start[person].values, strict=True)
                )
            sources = tuple("pinned" if pinned else s for s, pinned in zip(free, found.pinned[person], strict=True))
            doubt = ("", "") if person in vouched else (start[person].status, start[person].remark)
            source = "pinned" if pins[person] else "fitted"
            people[person] = ShownPose(found.poses[person], source, *doubt, sources=sources)
        costs = session_state.costs(tuple(p.values for p in people))
        session_state.set(people=tuple(people), pins=pins, **vars(costs))

    def _timed(self, pins: Pins) -> list[list[PointObservation]]:
        """Return the pins of all people with the times of their pictures."""
        cameras, frame = self._session_state.session.cameras, self._session_state.state.frame
        return [[p._replace(ahead_frames=cameras[p.camera].clock.offset_frames(frame)) for p in own] for own in pins]

    def _save(self, drag: _PinDrag) -> None:
        """Save the gesture so far."""
        had = any((p.point, p.camera) == (drag.point, drag.camera) for p in drag.pins[drag.person])
        if drag.pins == self._session_state.state.pins and self._session_state.open_edit_owner is not drag:
            return
        what = f"{'move' if had else 'set'} pin {display_name(drag.point)}{self._in(drag.camera)}"
        self._session_state.save(what, "fitted", drag, drag.person)

    def _in(self, camera: int | None) -> str:
        return "" if camera is None else f" in {self._session_state.session.cameras[camera].camera.name}"


def _with_pin(pins: Pins, person: int, pin: PointObservation) -> Pins:
    """Return the pins with one set or moved, by point and camera."""
    others = [p for p in pins[person] if (p.point, p.camera) != (pin.point, pin.camera)]
    own = tuple(sorted([*others, pin], key=lambda p: (p.point, p.camera)))
    return (*pins[:person], own, *pins[person + 1 :])


def _is_shown(source: Camera, position_px: tuple[float, float]) -> bool:
    """Return whether an undistorted picture shows footage at a position; black corners of a fisheye's have none."""
    is_within = _clipped(position_px, source.pinhole.size) == position_px
    return is_within and (not source.fisheye or bool(source.is_filmed(np.array(position_px))))


def _clipped(position_px: tuple[float, float], size: tuple[int, int]) -> tuple[float, float]:
    """Return the nearest position within an image."""
    u, v = np.clip(position_px, -0.5, (size[0] - 0.5, size[1] - 0.5))
    return float(u), float(v)
