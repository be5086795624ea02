"""Updates of the lines over the pictures of one page: bodies, contours, pins (docs/protocol.md)."""

import asyncio
from collections.abc import Callable

from app.control.controller import Controller
from app.messages import encoding
from app.state import page_view
from app.state.identity import ObjectIdentity
from app.state.page_view import View
from app.state.state import State
from tracker.evidence.view_evidence import ViewEvidence

_EDGES = ("accepted", "rejected")
"""Layers of lines that are drawn from the evidence."""


class OverlayFeed:
    """Remembers from what the lines were drawn that one page shows."""

    def __init__(self, controller: Controller, page: int, wake: Callable[[State], None]) -> None:
        """Begin with nothing drawn.

        Args:
            controller: of the session.
            page: number of the page.
            wake: called with the state when evidence arrives that the page waits for.
        """
        self._controller, self._page, self._wake = controller, page, wake
        self._made_from: tuple[object, ...] = ()

    async def update(self, state: State, view: View) -> bytes | None:
        """Return the lines as an encoded message; None if the page has them."""
        views, replay = self._evidence(state, view), state.search_view.replay
        shows_residuals = replay is not None and replay.fitted_from is not None
        if (view.layers.isdisjoint(_EDGES) and not shows_residuals) or "contours" not in state.compiled:
            views = None
        ingredients = (*_ingredients(state), view, views is None)
        if ingredients == self._made_from:
            return None
        self._made_from = ingredients
        session = self._controller.session_of(state)
        return await asyncio.to_thread(encoding.overlay, session, state, self._page, view, views)

    def close(self) -> None:
        """Wait for no evidence any more."""
        self._controller.frames.forget(self)

    def _evidence(self, state: State, view: View) -> tuple[ViewEvidence, ...] | None:
        """Return the cached evidence of the shown frame if the page shows any; request it if it is not cached."""
        replay = state.search_view.replay
        if view.layers.isdisjoint(page_view.EVIDENCE) and (replay is None or replay.fitted_from is None):
            return None
        frames, views = self._controller.frames, self._controller.frames.cached_evidence(state.frame)
        if views is None and "evidence" in state.compiled:
            frames.request(state.frame, lambda _: self._wake(state), self)
        return views


def _ingredients(state: State) -> tuple[object, ...]:
    """Return what an overlay depends on, for comparison. Poses are compared by identity."""
    drawn = (
        state.frame,
        tuple(ObjectIdentity(p.values) for p in state.people),
        ObjectIdentity(state.drawn.people[state.person].errors),
        state.revisions,
        state.draft,
        None if state.search.candidate is None else tuple(map(ObjectIdentity, state.search.candidate)),
        state.search.running,
        state.search_view,
        state.range_comparison,
        state.compared if not state.is_stored_drawn else None,
        () if state.compared is None else state.compared.moved,
        state.drag,
        state.drag_seqs,
        state.people_not_drawn,
        state.compiled,
        ObjectIdentity(state.finding.candidates),
        state.calibration.n_changes,
        ObjectIdentity(state.calibration.preview) if state.calibration.is_previewed else None,
        ObjectIdentity(None if state.reason is None else state.reason.alternatives),
        ObjectIdentity(None if state.other_copy is None else state.other_copy.poses),
        ObjectIdentity(state.observations.plan),
        ObjectIdentity(state.observations.shown),
        ObjectIdentity(state.observations.judgements),
    )
    return (*drawn, _pins(state), state.floor.picking)


def _pins(state: State) -> object:
    """Return what the drawing of pins depends on: the joint worked on has lines and a triangulated point."""
    return (state.pins, state.person, state.point) if any(state.pins) else None
