"""Assess poses that a user has chosen, in the background, by the frames around them."""

import logging
import time
from typing import NamedTuple

from app.control.session.session_state import SessionState
from app.control.tracking import track_settings
from app.control.tracking.poses_around import pose_in_run
from app.remedies import page_text
from app.runtime.jobs import LatestWinsWorker, StoppedError
from app.state.state import State
from tracker.errors import TrackerError
from tracker.pipeline.pose_check import checked_pose, compared_pose
from tracker.session.store.records import AssessmentChange, PoseChange, PoseRecord

_LOG = logging.getLogger(__name__)
_GIVE_WAY_S = 0.05
"""Time between two looks at whether a drag has ended, which goes first."""


class _Stored(NamedTuple):
    """A row that was stored, and its entry of the history."""

    change: PoseChange
    edit: int | None
    """None where it waits to be written."""


class PoseChecks:
    """Assesses poses one after the other. A pose that changes meanwhile keeps what is stored of it then."""

    def __init__(self, session_state: SessionState) -> None:
        """Assess nothing yet.

        Args:
            session_state: holds the state.
        """
        self._session_state, self._closed = session_state, False
        self._latest: LatestWinsWorker[_Stored] = LatestWinsWorker(self._check, "pose checks")

    def check(self, change: PoseChange, edit: int | None) -> None:
        """Assess a pose that has just been stored; its status becomes a part of the same entry of the history.

        Args:
            change: the row.
            edit: the entry; None where it waits to be written.
        """
        at = self._person(change), change.frame
        with self._session_state.lock:
            self._session_state.set(checked=self._session_state.state.checked | {at})
        self._latest.offer(_Stored(change, edit), at)

    def close(self) -> None:
        """End the thread."""
        self._closed = True
        self._latest.close()

    def _person(self, change: PoseChange) -> int:
        return [p.name for p in self._session_state.session.people].index(change.person)

    def _check(self, stored: _Stored) -> None:
        session_state, change = self._session_state, stored.change
        person = self._person(change)
        try:
            state = session_state.state
            settings = track_settings.of_estimates(state.settings, state.run_choices)
            record = change.pose
            with session_state.lock:
                present = session_state.saver.revisions.current(person)
                pose = pose_in_run(session_state, person, change.frame)
            if record is not None and record.model_revision == present:
                session, observer = session_state.session, session_state.frames.observer.at_nearest_times()
                found = compared_pose(session, observer, settings, pose, self._report)
                self._store(person, stored, checked_pose(session.people[person].model, record, found))
        except StoppedError:
            return
        except TrackerError as error:
            _LOG.info("a pose was not assessed: %s", page_text(error))
        finally:
            with session_state.lock:
                session_state.set(checked=session_state.state.checked - {(person, change.frame)})

    def _report(self, stage: str, share: float, text: str = "", /) -> None:
        """Let a drag go first."""
        while not self._closed and _is_busy(self._session_state.state):
            time.sleep(_GIVE_WAY_S)
        if self._closed:
            raise StoppedError

    def _store(self, person: int, stored: _Stored, found: PoseRecord) -> None:
        """Store an assessment, unless the pose has changed meanwhile."""
        session_state, change, saver = self._session_state, stored.change, self._session_state.saver
        with session_state.lock:
            now = saver.record(person, change.frame)
            if change.pose is None or now is None or now.values.tolist() != change.pose.values.tolist():
                return
            last = next((e.edit for e in saver.moves.entries(1) if not e.undone), None)
            amend = stored.edit if stored.edit is not None and stored.edit == last else None
            row = AssessmentChange.of(change.person, change.frame, found)
            saver.write(f"assess the pose, frame {change.frame}", [row], amend, by_program=False)
            if session_state.state.frame == change.frame:
                session_state.show_frame(frame=change.frame)
            session_state.refresh_saving()


def _is_busy(state: State) -> bool:
    """Return whether the user does something that goes first."""
    return state.is_dragging or state.search.running
