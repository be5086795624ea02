"""Say who works on which poses now: two people take turns at one pose."""

from collections.abc import Callable, Container, Iterable
from typing import NamedTuple

from app.state.state import State
from tracker.errors import TrackerError
from tracker.session.store.records import ALL_FRAMES


class TurnError(TrackerError):
    """Another person works on a pose; nothing was changed."""


class Work(NamedTuple):
    """Something that is being done to poses of a session."""

    what: str
    """As text for others: `drags`, `tracks frames 10 to 50`."""
    people: frozenset[int] | None
    """Indices of the people whose poses change; None for all."""
    frames: Container[int]


class _Worker(NamedTuple):
    owner: object
    name: Callable[[], str]
    state: Callable[[], State]


class Turns:
    """Those who may change poses of one session. The caller holds the session's lock."""

    def __init__(self) -> None:
        """Begin with nobody."""
        self._workers: list[_Worker] = []

    def add(self, owner: object, name: Callable[[], str], state: Callable[[], State]) -> None:
        """Add somebody.

        Args:
            owner: stands for them in all calls.
            name: returns how others call them.
            state: returns their state, with their work in progress.
        """
        self._workers.append(_Worker(owner, name, state))

    def remove(self, owner: object) -> None:
        """Remove somebody who does nothing any more."""
        self._workers = [w for w in self._workers if w.owner is not owner]

    def require(self, owner: object, poses: Iterable[tuple[int, int]]) -> None:
        """Check that nobody else works on poses.

        Args:
            owner: wants to change them.
            poses: index of the person and frame.

        Raises:
            TurnError: somebody does.
        """
        others = self._others(owner)
        for person, frame in poses if others else ():
            for other, work in others:
                if frame in work.frames and (work.people is None or person in work.people):
                    raise TurnError(
                        f"expected frame {frame} to be free, found that {other.name()} {work.what}; "
                        "wait until that is done, or edit another frame"
                    )

    def require_alone(self, owner: object) -> None:
        """Check that nobody else works on any pose, before all of them change.

        Raises:
            TurnError: somebody does.
        """
        for other, work in self._others(owner):
            raise TurnError(
                f"expected nobody else at work while bodies or cameras change, found that {other.name()} {work.what}; "
                "wait until that is done"
            )

    def _others(self, owner: object) -> list[tuple[_Worker, Work]]:
        found = ((w, work_of(w.state())) for w in self._workers if w.owner is not owner)
        return [(worker, work) for worker, work in found if work is not None]


def work_of(state: State) -> Work | None:
    """Return what somebody with a state does to poses now; None for nothing."""
    track = state.track
    if state.drag is not None:
        return Work(f"drags on frame {state.frame}", frozenset({state.drag.person}), {state.frame})
    if state.is_pin_held:
        return Work(f"sets a pin on frame {state.frame}", frozenset({state.person}), {state.frame})
    if state.search.running:
        return Work(f"searches frame {state.frame}", None, {state.frame})
    if track.running and track.first is not None and track.last is not None:
        first, last = sorted((track.first, track.last))
        return Work(f"tracks frames {first} to {last}", None, range(first, last + 1))
    if state.ranges.frames:
        what, people, frames = state.ranges.what, state.ranges.people, state.ranges.frames
        return Work(f"is {what} frames {frames[0]} to {frames[-1]}", people, frames)
    if state.finding.running:
        return Work("finds people", None, ALL_FRAMES)
    return None
