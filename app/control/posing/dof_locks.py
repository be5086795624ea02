"""Lock degrees of freedom, so that no drag, search or fit moves them; stored with the session."""

from collections.abc import Collection

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from tracker.body.model import BodyModel
from tracker.session.locked_dofs import SETTING, load_locks, locks_setting


class DofLocks:
    """The locked degrees of freedom of all people."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Restore the locks of the session.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities
        session_state.set(locked=load_locks(session_state.session.people, session_state.saver.setting))

    def set(self, person: int, dofs: Collection[int], locked: bool) -> None:
        """Lock or unlock degrees of freedom, each ball joint as a whole; on disk when this returns.

        Args:
            person: index of the person.
            dofs: indices of the degrees of freedom; unknown ones are ignored.
            locked: whether to lock them.

        Raises:
            TrackerError: the session's settings cannot be written.
        """
        model = self._session_state.models[person]
        chosen = _with_whole_balls(model, {d for d in dofs if 0 <= d < model.n_dofs})
        with self._activities.editing():
            before = self._session_state.state.locked
            now = before[person] | chosen if locked else before[person] - chosen
            if now == before[person]:
                return
            after = (*before[:person], now, *before[person + 1 :])
            self._session_state.saver.store_setting(SETTING, locks_setting(self._session_state.session.people, after))
            self._session_state.set(locked=after)


def _with_whole_balls(model: BodyModel, dofs: Collection[int]) -> frozenset[int]:
    """Add the other axes of ball joints: one component of a rotation vector cannot be locked alone."""
    balls = {int(model.dof_joint[d]) for d in dofs if model.joints[model.dof_joint[d]].kind == "ball"}
    axes = (i for i in range(model.n_dofs) if model.dof_joint[i] in balls and not model.dof_is_length[i])
    return frozenset(dofs) | frozenset(axes)
