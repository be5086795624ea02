"""The pane socket: state to messages, events of the panes to the controller (docs/protocol.md)."""

import asyncio
import itertools
import json
import logging
from collections import deque
from collections.abc import Coroutine
from typing import Any

import aiohttp
from aiohttp import web

from app.control.controller import Controller
from app.drawing import curves
from app.page import intentions, messages, picture_sets
from app.page.search_feed import SearchFeed
from app.state import page_view
from app.state.page_view import View
from app.state.state import State
from tracker.errors import TrackerError
from tracker.evidence.view_evidence import ViewEvidence

_LOG = logging.getLogger(__name__)
_READABLE_S = 0.2
"""Time between updates of the page's figures while a hand drags or a search is at work: nobody reads them faster."""
_WATCHABLE_S = 1 / 60
"""Time between two looks at a search at work: more nobody sees, and the search needs the processor too."""
_MOST_HISTORY = 2000
"""Entries of the history, each way, that a page may ask for."""
_EDGES = ("accepted", "rejected")
"""Layers of lines that are drawn from the evidence."""
_COALESCED = ("seek", "view", "replay", "preview", "search_speed")
"""Of these only the newest that waits is carried out."""


class Panes:
    """Serves the panes of every page that is open on the session."""

    def __init__(self, controller: Controller) -> None:
        """Serve this controller's session."""
        self._controller = controller
        self._pages = itertools.count(1)

    async def serve(self, socket: web.WebSocketResponse) -> None:
        """Talk to one page until its socket closes."""
        page = _Page(next(self._pages), self._controller, socket)
        await page.serve()


class _Page:
    """One page that is connected."""

    def __init__(self, number: int, controller: Controller, socket: web.WebSocketResponse) -> None:
        self._number, self._controller, self._socket = number, controller, socket
        self._changed = asyncio.Event()
        self._arrived = asyncio.Event()
        self._waiting: deque[dict[str, Any]] = deque()
        self._sent: State | None = None
        self._sent_text: dict[str, Any] | None = None
        self._sent_text_at = 0.0
        self._reminder: asyncio.TimerHandle | None = None  # that figures are due
        self._sent_overlay: tuple[object, ...] = ()  # what it was drawn from
        self._view: View | None = None  # nothing is drawn for a page that has not said what it shows
        self._pictures = picture_sets.PictureSets(controller)
        self._curves: str | None = None
        self._sent_curves: tuple[str, int, int] | None = None  # group, person, version of the timeline
        self._feed = SearchFeed()
        self._history_limit = 0  # of entries each way; 0: the page does not show them
        self._sent_history: dict[str, Any] | None = None
        self._loop = asyncio.get_running_loop()

    async def serve(self) -> None:
        unsubscribe = self._controller.subscribe(self._wake)
        self._changed.set()
        tasks = [asyncio.create_task(self._guarded(t)) for t in (self._send_all(), self._act())]
        try:
            async for message in self._socket:
                if message.type == aiohttp.WSMsgType.TEXT:
                    self._receive(json.loads(message.data))
        finally:
            unsubscribe()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await asyncio.to_thread(self._controller.dragging.end, self._number)
            await asyncio.to_thread(self._controller.pinning.end, self._number)
            await asyncio.to_thread(self._controller.view_3d.pause, self._number, False)
            self._controller.cost_landscape.watch(self._number, False)

    def _wake(self, _: State) -> None:
        """Let the sender look again; called from any thread."""
        self._loop.call_soon_threadsafe(self._changed.set)

    async def _guarded(self, work: Coroutine[Any, Any, None]) -> None:
        """Close the socket where its work fails: the page connects again and is told everything anew."""
        try:
            await work
        except ConnectionError:
            _LOG.debug("a page went away in the middle of a message")
        except Exception:
            _LOG.exception("a pane socket failed; the page connects again")
            await self._socket.close(code=aiohttp.WSCloseCode.INTERNAL_ERROR)

    # --- page to controller ------------------------------------------------------------------------------------

    def _receive(self, message: dict[str, Any]) -> None:
        """Queue a message; a newer seek, or a newer move of the same drag, takes the place of one that waits."""
        last = self._waiting[-1] if self._waiting else None
        if last is not None and last["type"] == message.get("type"):
            moves = message["type"] in ("drag", "pin") and last.get("phase") == message.get("phase") == "move"
            if moves or message["type"] in _COALESCED:
                self._waiting.pop()
        self._waiting.append(message)
        self._arrived.set()

    async def _act(self) -> None:
        while True:
            await self._arrived.wait()
            self._arrived.clear()
            while self._waiting:
                message = self._waiting.popleft()
                try:
                    await asyncio.to_thread(self._carry_out, message)
                except TrackerError as error:
                    await self._notice(str(error))
                except (KeyError, TypeError, ValueError) as error:
                    await self._notice(f"the page sent a message that is not understood ({error}); reload it")

    def _carry_out(self, message: dict[str, Any]) -> None:
        if message["type"] == "curves":
            self._open_curves(message["group"])
        elif message["type"] == "watch":
            self._feed = SearchFeed(message["tab"])
            self._controller.cost_landscape.watch(self._number, message["tab"] == "landscape")
            self._wake(self._controller.state)
        elif message["type"] == "history":
            self._history_limit = min(max(0, int(message["limit"])), _MOST_HISTORY)
            self._sent_history = None
            self._wake(self._controller.state)
        elif message["type"] == "view":
            self._view = page_view.view_of(message, len(self._controller.session.cameras))
            self._wake(self._controller.state)
        else:
            intentions.carry_out(self._controller, self._number, message)

    def _open_curves(self, group: str | None) -> None:
        if group is not None and group not in curves.GROUPS:
            raise ValueError(f"'{group}' is no group of curves")
        self._curves = group
        self._wake(self._controller.state)

    # --- controller to page ------------------------------------------------------------------------------------

    async def _send_all(self) -> None:
        await self._send(messages.session(self._controller.session))
        while True:
            await self._changed.wait()
            self._changed.clear()
            state, sent = self._controller.state, self._sent
            self._sent, began = state, self._loop.time()
            with_figures = self._figures_are_due(state)
            try:
                if with_figures:  # else the vectors go first: they are what the eye follows
                    await self._send_state(state)
                if sent is None or sent.timeline_version != state.timeline_version:  # the text may tell of its cells
                    await self._send_timeline(0 if sent is None else sent.timeline_version)
                if self._view is not None:
                    await self._send_drawn(state, self._view)
                if sent is None or sent.disagreeing != state.disagreeing:
                    await self._send(messages.disagreeing(state.disagreeing))
                await self._send_curves(state)
                await self._send_history()
                for news in await asyncio.to_thread(self._feed.news, self._controller, with_figures):
                    await (self._socket.send_bytes(news) if isinstance(news, bytes) else self._send(news))
                if state.track.failed and (sent is None or sent.track is not state.track):
                    await self._notice(state.track.message)
            except TrackerError as error:
                await self._notice(str(error))
            if state.search.running:
                await asyncio.sleep(max(0.0, began + _WATCHABLE_S - self._loop.time()))

    def _figures_are_due(self, state: State) -> bool:
        """Whether it is time for figures; if not, this page is woken when it is."""
        sent, now = self._sent_text, self._loop.time()
        is_busy = state.is_dragging or (state.search.running and sent is not None and sent["job"]["running"])
        due = self._sent_text_at + _READABLE_S
        if sent is None or not is_busy or now >= due:
            self._sent_text_at = now
            return True
        if self._reminder is None:
            self._reminder = self._loop.call_at(due, self._remind)
        return False

    def _remind(self) -> None:
        self._reminder = None
        self._changed.set()

    async def _send_state(self, state: State) -> None:
        """Send what the page's text shows, if it changed."""
        message = messages.state(self._controller.session, state)
        if message != self._sent_text:
            self._sent_text = message
            await self._send(message)

    async def _send_drawn(self, state: State, view: View) -> None:
        """Send what the panes show and the page does not have: vectors, then the pictures made meanwhile.

        In this order: the vectors wait in the page for the pictures of their frame, never the other way round.
        """
        pictures = asyncio.create_task(self._pictures.missing(state, view))
        try:
            await self._send_overlay(state, view)
        finally:
            made = await pictures
        for message in made:
            await self._socket.send_bytes(message)

    async def _send_overlay(self, state: State, view: View) -> None:
        views = self._evidence(state, view)
        if view.layers.isdisjoint(_EDGES):
            views = None
        drawn = (*_drawn(state), view, views is None)
        if drawn == self._sent_overlay:
            return
        self._sent_overlay = drawn
        message = await asyncio.to_thread(
            messages.overlay, self._controller.session_of(state), state, self._number, view, views
        )
        await self._socket.send_bytes(message)

    def _evidence(self, state: State, view: View) -> tuple[ViewEvidence, ...] | None:
        """The evidence of the shown frame, if the page shows any of it and it is at hand; it is asked for where not."""
        if view.layers.isdisjoint(page_view.EVIDENCE):
            return None
        frames, views = self._controller.frames, self._controller.frames.cached_evidence(state.frame)
        if views is None:
            frames.request(state.frame, lambda _: self._wake(state))
        return views

    async def _send_timeline(self, since: int) -> None:
        several = range(len(self._controller.models)) if len(self._controller.models) > 1 else ()
        for person in (None, *several):
            cells = self._controller.stored_poses.timeline(since, person)
            message = await asyncio.to_thread(messages.timeline, cells, since == 0, person)
            await (self._socket.send_bytes(message) if isinstance(message, bytes) else self._send(message))

    async def _send_curves(self, state: State) -> None:
        """Send the open group of curves: whole where it is another than before, else the frames that changed."""
        if self._curves is None:
            self._sent_curves = None
            return
        wanted, sent = (self._curves, state.person, state.timeline_version), self._sent_curves
        if wanted == sent:
            return
        self._sent_curves = wanted
        since = sent[2] if sent is not None and sent[:2] == wanted[:2] else 0
        group, person = wanted[:2]
        frames, rows = await asyncio.to_thread(self._controller.stored_poses.rows, person, since)
        message = await asyncio.to_thread(
            messages.curves, self._controller.session, person, group, frames, rows, since == 0
        )
        await self._socket.send_bytes(message)

    async def _send_history(self) -> None:
        """Send the history to a page that shows it, where it has changed."""
        if (limit := self._history_limit) == 0:
            return
        entries = await asyncio.to_thread(self._controller.history.entries, limit + 1)
        message = messages.history(entries, limit)
        if message != self._sent_history:
            self._sent_history = message
            await self._send(message)

    async def _notice(self, text: str) -> None:
        await self._send({"type": "notice", "level": "error", "text": text})

    async def _send(self, message: dict[str, Any]) -> None:
        await self._socket.send_str(json.dumps(message))


def _drawn(state: State) -> tuple[object, ...]:
    """What an overlay depends on, to be compared."""
    poses = tuple(id(p.values) for p in state.people)
    candidate = None if state.search.candidate is None else tuple(id(c) for c in state.search.candidate)
    drawn = (
        state.frame,
        poses,
        state.revisions,
        state.draft,
        candidate,
        state.search.running,
        state.search_view,
        state.drag,
        state.drag_seqs,
        state.visibility.hidden,
    )
    return (*drawn, _pins(state), state.floor.picking)


def _pins(state: State) -> object:
    """What the drawing of pins depends on: the joint worked on has lines and a meeting point."""
    return (state.pins, state.person, state.point) if any(state.pins) else None
