"""Updates of the curves below the timeline: all of a new group, otherwise the frames that changed."""

from app.control.controller import Controller
from app.drawing.curves import CurveGroup
from app.messages import encoding
from app.state.page_view import View
from app.state.state import State


class CurveFeed:
    """Remembers which group of curves one page shows, and up to which version of the timeline it has it."""

    def __init__(self) -> None:
        """Begin without curves."""
        self._group: CurveGroup | None = None
        self._sent: tuple[CurveGroup, int, int] | None = None  # group, person, version of the timeline

    def show(self, group: CurveGroup | None) -> None:
        """Note which group the page shows; None for none."""
        self._group = group

    def is_due(self, state: State, _: View | None = None) -> bool:
        """Return whether the page lacks curves; quick."""
        if self._group is None:
            self._sent = None
        return self._group is not None and self._sent != (self._group, state.person, state.timeline_version)

    def updates(self, controller: Controller, state: State) -> list[bytes]:
        """Return the curves that the page lacks as an encoded message. It reads the annotations: call it in a worker.

        Returns nothing where the page has put the curves away since they were due.

        Raises:
            SessionError: the annotations cannot be read.
        """
        group, sent = self._group, self._sent
        if group is None:
            return []
        self._sent = group, state.person, state.timeline_version
        since = sent[2] if sent is not None and sent[:2] == self._sent[:2] else 0
        frames, rows = controller.stored_poses.rows(state.person, since)
        return [encoding.curves(controller.session, state.person, group, frames, rows, since == 0)]
