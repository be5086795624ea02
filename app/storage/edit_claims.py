"""Say who works on which poses now: two people take turns at one pose."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from app.state.progress import PoseWork
from app.state.state import State
from tracker.errors import TrackerError


class EditClaimError(TrackerError):
    """Another person works on a pose; nothing was changed."""


class _Worker(NamedTuple):
    owner: object
    name: Callable[[], str]
    state: Callable[[], State]


class EditClaims:
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
                    raise EditClaimError(
                        f"expected frame {frame} to be free, found that {other.name()} {work.what}; "
                        "wait until that is done, or edit another frame"
                    )

    def require_alone(self, owner: object) -> None:
        """Check that nobody else works on any pose, before all of them change.

        Raises:
            TurnError: somebody does.
        """
        for other, work in self._others(owner):
            raise EditClaimError(
                f"expected nobody else at work while bodies or cameras change, found that {other.name()} {work.what}; "
                "wait until that is done"
            )

    def _others(self, owner: object) -> list[tuple[_Worker, PoseWork]]:
        found = ((w, w.state().pose_work) for w in self._workers if w.owner is not owner)
        return [(worker, work) for worker, work in found if work is not None]
