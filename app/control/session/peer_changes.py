"""Keep the states of several people on one session together: stored poses, and what belongs to the session."""

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

from app.control.session.session_state import SessionState
from app.state.state import State

_OF_SESSION = ("footage", "inconsistent_frames", "keyframe_doubts")
"""Fields of the state that are the same for everybody."""


class PeerChanges:
    """Shows what others have stored. Frame, selection and view stay one's own."""

    def __init__(self, session_state: SessionState, on_new: Callable[[], None]) -> None:
        """Listen to the others.

        Args:
            session_state: holds the state.
            on_new: called under the lock when others have changed a pose that is shown.
        """
        self._session_state, self._on_new = session_state, on_new
        session_state.saver.shared.listeners.append(self._stored)

    def close(self) -> None:
        """Listen no more."""
        listeners = self._session_state.saver.shared.listeners
        if self._stored in listeners:
            listeners.remove(self._stored)

    def _stored(self, owner: object, frames: Collection[int]) -> None:
        session_state = self._session_state
        if owner is session_state.saver.moves or not frames:
            return
        if session_state.state.frame in frames and session_state.show_peer_changes():
            self._on_new()
        session_state.refresh_saving()


class FollowingHost:
    """Takes over what belongs to the session from the state of its host: bodies, cameras, footage, checks, the plan."""

    def __init__(self, session_state: SessionState, host: SessionState, finish: Callable[[], None]) -> None:
        """Follow the host.

        Args:
            session_state: holds the state that follows.
            host: holds the state of the host.
            finish: ends the gestures of the one who follows; called under the lock.
        """
        self._session_state, self._host, self._finish = session_state, host, finish
        with host.lock:
            self._follow(host.state)
            self._unsubscribe = host.subscribe(self._follow)

    def close(self) -> None:
        """Follow no more."""
        self._unsubscribe()

    def _follow(self, host: State) -> None:
        session_state = self._session_state
        if session_state.session is not self._host.session:
            self._finish()
            session_state.follow_session(self._host.session)
        own = session_state.state
        if own.compiled != host.compiled:
            session_state.note_compiled(host.compiled)
        changes: dict[str, Any] = {
            name: getattr(host, name) for name in _OF_SESSION if getattr(own, name) is not getattr(host, name)
        }
        if "footage" in changes:
            changes |= vars(session_state.costs(own.poses))
        if own.calibration.n_changes != host.calibration.n_changes:
            changes["calibration"] = replace(own.calibration, n_changes=host.calibration.n_changes)
        plan, theirs = own.annotation, host.annotation
        if plan.tasks is not theirs.tasks or plan.comments is not theirs.comments or plan.speeds is not theirs.speeds:
            changes["annotation"] = replace(plan, tasks=theirs.tasks, comments=theirs.comments, speeds=theirs.speeds)
        if changes:
            session_state.set(**changes)
            session_state.request_evidence()
