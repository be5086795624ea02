"""Pins by hand: set, moved, removed; the fit that takes them in. Each gesture is one entry of the history."""

import time
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np

from app.control.session.session_state import Screen
from app.state.state import Shown
from tracker.body.limbs import display_name
from tracker.errors import TrackerError
from tracker.geometry.triangulation import PointObservation
from tracker.posing.pinned_fit import fit_frame

_CHECKPOINT_S = 1.0
"""A long drag of a pin is on disk at least this often."""

Pins = tuple[tuple[PointObservation, ...], ...]


@dataclass(frozen=True, eq=False)
class _Held:
    """A pin in the hand."""

    page: int
    """Number of the page whose hand it is."""
    person: int
    point: str
    camera: int
    pins: Pins
    """The pins of everybody before the gesture."""
    people: tuple[Shown, ...]
    """Everybody before the gesture: where each of its fits starts from, so that only the pin's place decides."""
    live: bool
    """Whether the body follows while the pin moves."""


class Pinning:
    """The pins of the frame that is shown; at most one is in a hand."""

    def __init__(self, screen: Screen, editing: Callable[[], AbstractContextManager[None]]) -> None:
        """Pin who is on this screen.

        Args:
            screen: holds the state.
            editing: gives the lock with nothing at work and no gesture at hand (`Controller.editing`).
        """
        self._screen, self._editing = screen, editing
        self._held: _Held | None = None

    def begin(
        self, page: int, frame: int, camera: int, person: int, point: str, position_px: tuple[float, float], live: bool
    ) -> None:
        """Set a pin, or take hold of the one that the point has in this view.

        Args:
            page: number of the page.
            frame: the frame that the hand saw, which a tracker may have left meanwhile.
            camera: index of the view.
            person: index of the person.
            point: name of the point.
            place_px: where it is seen, undistorted px.
            live: whether the body follows as the pin is moved.

        Raises:
            TrackerError: the place is outside of the image.
        """
        session = self._screen.session
        if not (0 <= frame < session.n_frames and 0 <= camera < len(session.cameras)):
            return
        if not (0 <= person < len(self._screen.models) and point in self._screen.models[person].point_names):
            return
        source = session.cameras[camera].camera
        if _within(position_px, source.size) != position_px:
            raise TrackerError(
                f"expected a pin within the {source.width}x{source.height} px of {source.name}, found it at "
                f"({position_px[0]:.0f}, {position_px[1]:.0f}); set it where the image shows the joint"
            )
        with self._editing():
            self._screen.go_to(frame)
            state = self._screen.state
            self._held = _Held(page, person, point, camera, state.pins, state.people, live)
            self._screen.last_save = time.monotonic()
            pins = _with(state.pins, person, PointObservation(point, camera, position_px))
            self._screen.set(person=person, point=point, pins=pins, holds_pin=True)

    def move(self, page: int, position_px: tuple[float, float]) -> None:
        """Move the pin in the hand, at most to the border of the image; the body follows where that was wanted."""
        with self._screen.lock:
            held = self._held
            if held is None or page != held.page:
                return
            position_px = _within(position_px, self._screen.session.cameras[held.camera].camera.size)
            pins = _with(self._screen.state.pins, held.person, PointObservation(held.point, held.camera, position_px))
            if pins == self._screen.state.pins:
                return  # a click only sets it
            if held.live:
                self._show_fit([held.person], held.people, pins)
            else:
                self._screen.set(pins=pins)
            if time.monotonic() - self._screen.last_save > _CHECKPOINT_S:
                self._save(held)

    def end(self, page: int) -> None:
        """Let go: the gesture is one entry of the history, on disk when this returns."""
        with self._screen.lock:
            if self._held is not None and page == self._held.page:
                self.finish()

    def cancel(self, page: int) -> None:
        """Let go and put pins and body back where they were."""
        with self._screen.lock:
            held = self._held
            if held is None or page != held.page:
                return
            self._held = None
            self._screen.take_back(held)

    def finish(self) -> None:
        """End the gesture at hand, if there is one, and save it; called under the lock."""
        held = self._held
        if held is None:
            return
        self._save(held)
        self._held = self._screen.edit_of = None
        self._screen.set(holds_pin=False)

    def remove(self, frame: int, person: int, point: str | None = None, camera: int | None = None) -> None:
        """Take away the pins of a person on a frame: of one point, in one view, or all; one entry of the history."""
        if not (0 <= frame < self._screen.session.n_frames and 0 <= person < len(self._screen.models)):
            return
        with self._editing():
            self._screen.go_to(frame)
            pins = list(self._screen.state.pins)
            pins[person] = tuple(
                p for p in pins[person]
                if not ((point is None or p.point == point) and (camera is None or p.camera == camera))
            )  # fmt: skip
            if len(pins[person]) == len(self._screen.state.pins[person]):
                return
            self._screen.set(pins=tuple(pins))
            what = "remove all pins" if point is None else f"remove pin {display_name(point)}{self._in(camera)}"
            self._screen.save(what, "manual")

    def fit(self, frame: int, person: int | None = None) -> None:
        """Fit people to pins and edges together.

        Args:
            frame: that the user saw.
            person: whom to fit, the others as they stand; by default the person worked on and everybody who has been
                placed or pinned on the frame.

        Raises:
            TrackerError: there is nothing to fit to: neither pins nor, yet, edges.
        """
        if not 0 <= frame < self._screen.session.n_frames:
            return
        with self._editing():
            self._screen.go_to(frame)
            state = self._screen.state
            views = self._screen.frames.evidence_at_hand(frame)
            placed = [i for i, shown in enumerate(state.people) if shown.source is not None or state.pins[i]]
            meant = {state.person, *placed} if person is None else {person}
            pinned = sorted(i for i in meant if state.pins[i])
            if views is None and not pinned:
                raise TrackerError(
                    "expected pins or edges to fit to, found no pin on this frame and its edges not there yet; "
                    "set pins, or try again in a moment"
                )
            people = sorted(meant) if views is not None else pinned
            self._show_fit(people, state.people, state.pins)
            told = " and ".join([*(["pins"] if pinned else []), *(["edges"] if views is not None else [])])
            self._screen.save(f"fit to {told}", "fitted")

    def _show_fit(self, fitted: Iterable[int], start: tuple[Shown, ...], pins: Pins) -> None:
        """Fit some people from a start, the others as they stand, and show them."""
        screen = self._screen
        fitted = list(fitted)
        views = screen.frames.evidence_at_hand(screen.state.frame)
        cameras = [c.camera for c in screen.session.cameras]
        free = [screen.free(person) for person in range(len(screen.models))]
        found = fit_frame(
            screen.models, [p.values for p in start], pins, cameras, views, screen.state.settings, fitted, free
        )
        people = list(start)
        for person in fitted:
            sources = tuple("pinned" if by_pin else "fitted" for by_pin in found.pinned[person])
            people[person] = Shown(found.poses[person], "pinned" if pins[person] else "fitted", sources=sources)
        poses = tuple(p.values for p in people)
        screen.set(people=tuple(people), pins=pins, **screen.costs(poses))

    def _save(self, held: _Held) -> None:
        """Write what the gesture has done so far."""
        had = any((p.point, p.camera) == (held.point, held.camera) for p in held.pins[held.person])
        if held.pins == self._screen.state.pins and self._screen.edit_of is not held:
            return
        what = f"{'move' if had else 'set'} pin {display_name(held.point)}{self._in(held.camera)}"
        self._screen.save(what, "fitted", held)

    def _in(self, camera: int | None) -> str:
        return "" if camera is None else f" in {self._screen.session.cameras[camera].camera.name}"


def _with(pins: Pins, person: int, pin: PointObservation) -> Pins:
    """The same pins but for one that is set or moved, by point and camera."""
    others = [p for p in pins[person] if (p.point, p.camera) != (pin.point, pin.camera)]
    own = tuple(sorted([*others, pin], key=lambda p: (p.point, p.camera)))
    return (*pins[:person], own, *pins[person + 1 :])


def _within(position_px: tuple[float, float], size: tuple[int, int]) -> tuple[float, float]:
    """The nearest place within an image."""
    u, v = np.clip(position_px, -0.5, (size[0] - 0.5, size[1] - 0.5))
    return float(u), float(v)
