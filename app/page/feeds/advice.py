"""The line over the views of a page (docs/protocol.md)."""

from app.advice.situations import advise
from app.advice.stored_work import PersonWork, StoredWork
from app.control.controller import Controller
from app.messages.advice import AdviceMessage
from app.state.page_view import View
from app.state.state import State


class AdviceFeed:
    """Remembers what one page has received, and what the session stored then."""

    def __init__(self) -> None:
        """Begin with nothing sent."""
        self._sent: AdviceMessage | None = None
        self._stored: StoredWork | None = None
        self._version = -1

    def is_due(self, state: State, _: View | None = None) -> bool:
        """Return whether there may be an update; quick. None is made during a drag."""
        return not state.is_dragging

    def updates(self, controller: Controller, state: State) -> list[AdviceMessage]:
        """Return the message that the page lacks. It sums up the timeline: call it in a worker."""
        is_busy = state.track.running and self._stored is not None  # its poses change twice a second
        if not is_busy and self._version != state.timeline_version:
            self._version = state.timeline_version
            self._stored = stored_work(controller)
        assert self._stored is not None
        message = AdviceMessage(tuple(advise(state, self._stored)))
        is_known, self._sent = message == self._sent, message
        return [] if is_known else [message]


def stored_work(controller: Controller) -> StoredWork:
    """Sum up what the session stores."""
    session, timeline = controller.session, controller.stored_poses.timeline
    is_lone = len(session.people) == 1
    people = (
        PersonWork.of(p.name, p.model, timeline(0, None if is_lone else i), session.fps)
        for i, p in enumerate(session.people)
    )
    names = tuple(c.camera.name for c in session.cameras)
    return StoredWork(tuple(people), session.n_frames, session.has_outlines, names)
