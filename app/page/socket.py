"""The pane socket: state to messages, messages to the controller (docs/protocol.md)."""

import asyncio
import itertools
import logging
from collections.abc import Coroutine, Sequence
from typing import Any, Protocol

import aiohttp
from aiohttp import web

from app.control.controller import Controller
from app.messages import client as wire
from app.messages import encoding
from app.messages.base import Message, encode_text
from app.messages.observation import WatchProvenance
from app.messages.parsing import MISUNDERSTOOD, MessageError, check_allowed, parse
from app.messages.server import HistoryMessage, NoticeMessage, StateMessage
from app.page import commands
from app.page.feeds.advice import AdviceFeed
from app.page.feeds.curves import CurveFeed
from app.page.feeds.inspector import InspectorFeed
from app.page.feeds.observability import ObservabilityFeed
from app.page.feeds.overlay import OverlayFeed
from app.page.feeds.pictures import PictureSets
from app.page.feeds.provenance import ProvenanceFeed
from app.page.feeds.search import SearchFeed
from app.page.inbox import FloodError, Inbox
from app.participants.participants import Participants, Visit
from app.participants.presence_feed import PresenceFeed
from app.remedies import page_text
from app.state.identity import ObjectIdentity
from app.state.page_view import View
from app.state.role import Role
from app.state.state import State
from tracker.errors import TrackerError
from tracker.session.session import Session

_LOG = logging.getLogger(__name__)
_READABLE_S = 0.2
"""Time between updates of the page's figures during a drag or a search: nobody reads them faster."""
_WATCHABLE_S = 1 / 60
"""Time between two updates of a running search: faster ones are invisible and take time from the search."""
_MAX_HISTORY = 2000
"""Largest number of history entries, in each direction, that a page may request."""


class Feed(Protocol):
    """News of one kind for one page."""

    def is_due(self, state: State, view: View | None, /) -> bool:
        """Return whether there may be news for what the page shows; quick."""

    def updates(self, controller: Controller, state: State, /) -> Sequence[Message | bytes]:
        """Return the messages that the page lacks; binary ones are encoded."""


class PaneSocket:
    """Serves every page that is open on the session."""

    def __init__(self, participants: Participants, notices: Sequence[str] = ()) -> None:
        """Serve a session.

        Args:
            participants: the people on the session.
            notices: shown by every page when it connects.
        """
        self._participants, self._notices = participants, notices
        self._pages = itertools.count(1)
        self._backlog = asyncio.Lock()

    async def serve(self, socket: web.WebSocketResponse, role: Role = "host", name: str = "") -> None:
        """Serve one page until its socket closes.

        Args:
            socket: to the page.
            role: that its link gives.
            name: by which it joins; empty for none.
        """
        visit = await asyncio.to_thread(self._participants.join, role, name)
        presence = PresenceFeed(self._participants)
        try:
            page = PageConnection(next(self._pages), visit, socket, presence, self._backlog)
            await page.serve(self._notices)
        finally:
            presence.close()
            await asyncio.to_thread(self._participants.leave, visit)


class PageConnection:
    """The connection to one page."""

    def __init__(
        self, number: int, visit: Visit, socket: web.WebSocketResponse, presence: PresenceFeed, backlog: asyncio.Lock
    ) -> None:
        """Prepare to serve a page.

        Args:
            number: of the page, unique while the program runs.
            visit: the controller that it shows, and its role; messages that this does not allow are refused.
            socket: to the page.
            presence: source of the places of all people.
            backlog: shared by the pages of a session. Of those with a link that are behind, one at a time is served.
        """
        self._backlog = backlog
        self._number, self._visit, self._socket, self._presence = number, visit, socket, presence
        self._controller = visit.controller
        self._changed = asyncio.Event()
        self._inbox = Inbox(has_limit=visit.role != "host")
        self._sent: State | None = None
        self._sent_text: StateMessage | None = None
        self._sent_text_at = 0.0
        self._reminder: asyncio.TimerHandle | None = None  # for figures that were held back
        self._overlay = OverlayFeed(visit.controller, number, self._wake)
        self._view: View | None = None  # nothing is drawn before the page's first view
        self._pictures = PictureSets(visit.controller)
        self._epipolar: tuple[tuple[int, float, float], ...] = ()
        self._sent_epipolar: tuple[object, ...] = ((),)  # what the lines were drawn from
        self._advice = AdviceFeed()
        self._curves = CurveFeed()
        self._searches = SearchFeed()
        self._inspector = InspectorFeed()
        self._observability = ObservabilityFeed()
        self._provenance = ProvenanceFeed()
        self._history_limit = 0  # entries in each direction; 0: not subscribed
        self._sent_history: HistoryMessage | None = None
        self._loop = asyncio.get_running_loop()

    async def serve(self, notices: Sequence[str] = ()) -> None:
        """Serve the page until its socket closes; its drags end then.

        Args:
            notices: that it shows first.
        """
        unsubscribe = self._controller.subscribe(self._wake)
        self._changed.set()
        work = (self._read(), self._send_all(notices), self._act(), self._send_presence())
        tasks = [asyncio.create_task(self._guarded(t)) for t in work]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)  # a reader may wait for those that failed
        finally:
            unsubscribe()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await asyncio.to_thread(self._controller.dragging.end, self._number)
            await asyncio.to_thread(self._controller.pinning.end, self._number)
            await asyncio.to_thread(self._controller.view_3d.pause, self._number, False)
            await asyncio.to_thread(self._controller.view_3d.blur_faces, self._number, False)
            self._controller.cost_landscape.watch(self._number, False)
            self._controller.reasons.watch(self._number, False)
            self._controller.cost_map.leave(self._number)
            self._overlay.close()

    def _wake(self, _: State) -> None:
        """Wake the sender; called from any thread."""
        self._loop.call_soon_threadsafe(self._changed.set)

    async def _guarded(self, work: Coroutine[Any, Any, None]) -> None:
        """Close the socket if its work fails: the page reconnects and receives everything again."""
        try:
            await work
        except ConnectionError:
            _LOG.debug("a page closed its socket during a message")
        except FloodError as error:
            _LOG.warning("the page of '%s' is closed: %s", self._visit.name, error)
            await self._socket.close(code=aiohttp.WSCloseCode.POLICY_VIOLATION, message=str(error).encode())
        except Exception:
            _LOG.exception("a pane socket failed; the page connects again")
            await self._socket.close(code=aiohttp.WSCloseCode.INTERNAL_ERROR)

    # --- page to controller ------------------------------------------------------------------------------------

    async def _read(self) -> None:
        async for message in self._socket:
            if message.type in (aiohttp.WSMsgType.TEXT, aiohttp.WSMsgType.BINARY):
                await self._receive(message)

    async def _receive(self, received: aiohttp.WSMessage) -> None:
        """Parse and queue a message; one that is refused waits for its turn, too."""
        try:
            if received.type is aiohttp.WSMsgType.BINARY:
                raise MessageError("a text message", f"a binary one of {len(received.data)} bytes")
            message = parse(received.data)
            if self._visit.role != "host" and isinstance(message, wire.Pause3d):
                return  # sent on connecting, before the page knows that it has no 3-D view
            check_allowed(self._visit.role, message, self._visit.has_place)
        except TrackerError as error:
            await self._inbox.put(error)
        else:
            await self._inbox.put(message)

    async def _act(self) -> None:
        while True:
            message = await self._inbox.take()
            if self._visit.role == "host" or not len(self._inbox):
                await self._answer(message)
                continue
            async with self._backlog:
                began = self._loop.time()
                await self._answer(message)
                await asyncio.sleep(self._loop.time() - began)  # half of the time is for the host

    async def _answer(self, message: wire.ClientMessage | TrackerError) -> None:
        try:
            if isinstance(message, TrackerError):
                raise message
            await asyncio.to_thread(self._carry_out, message)
        except TrackerError as error:
            await self._refuse(error)
        except Exception as error:
            _LOG.exception("a message of a page failed: %s", message)
            await self._notice(f"expected to carry out '{type(message).__name__}', found a fault: {error!r}")

    def _carry_out(self, message: wire.ClientMessage) -> None:
        match message:
            case wire.ShowCurves(group=group):
                self._curves.show(group)
            case wire.WatchTab(tab=tab):
                self._searches = SearchFeed(tab)
                self._controller.cost_landscape.watch(self._number, tab == "landscape")
            case wire.ShowHistory(limit=limit):
                self._history_limit = min(limit, _MAX_HISTORY)
                self._sent_history = None
            case wire.SetView():
                self._view = view_of(message, len(self._controller.session.cameras))
                if self._visit.role == "host":  # others have no 3-D view
                    self._controller.view_3d.blur_faces(self._number, "faces" in self._view.layers)
            case WatchProvenance(person=person):
                if person is not None:
                    commands.check_index(self._controller, "person", person)
                self._provenance.watch(message)
            case wire.CheckEpipolar(points=points):
                for camera, _, _ in points:
                    commands.check_index(self._controller, "camera", camera)
                self._epipolar = tuple(points)
            case _:
                commands.dispatch(self._controller, self._number, message)
                return
        self._wake(self._controller.state)

    # --- controller to page ------------------------------------------------------------------------------------

    async def _send_all(self, notices: Sequence[str]) -> None:
        names = _value_names(self._controller.session)
        await self._send(encoding.session(self._controller.session, self._visit.role, self._visit.has_place))
        for notice in notices:
            await self._send(NoticeMessage("info", notice))
        while True:
            await self._changed.wait()
            self._changed.clear()
            if _value_names(self._controller.session) != names:  # a person has other joints: everything is sent again
                await self._socket.close(code=aiohttp.WSCloseCode.SERVICE_RESTART)
                return
            state, sent = self._controller.state, self._sent
            self._sent, began = state, self._loop.time()
            with_figures = self._figures_are_due(state)
            try:
                # Otherwise the vectors go first: the eye follows them. No page may show what is not on disk as saved.
                if with_figures or (self._sent_text is not None and self._sent_text.saved and not state.saved):
                    await self._send_state(state)
                if with_figures:
                    await self._send_news(state, self._inspector)
                if sent is None or sent.timeline_version != state.timeline_version:  # after the text, which names cells
                    await self._send_timeline(0 if sent is None else sent.timeline_version)
                if self._view is not None and self._view.cameras:
                    await self._send_drawn(state, self._view)
                await self._send_epipolar(state)
                await self._send_checks(sent, state)
                if with_figures:
                    await self._send_news(state, self._curves, self._provenance, self._observability)
                await self._send_history()
                for update in await asyncio.to_thread(self._searches.updates, self._controller, with_figures):
                    await self._send(update)
                if with_figures and self._visit.role in ("host", "annotate"):  # others take no next step
                    await self._send_news(state, self._advice)
            except TrackerError as error:
                await self._notice(page_text(error))
            if state.search.running:
                await asyncio.sleep(max(0.0, began + _WATCHABLE_S - self._loop.time()))

    def _figures_are_due(self, state: State) -> bool:
        """Return whether to send figures now; if not, this page is woken in time."""
        sent, now = self._sent_text, self._loop.time()
        is_busy = state.is_dragging or (state.search.running and sent is not None and sent.job.running)
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
        """Send the page's texts and figures if they changed."""
        message = encoding.state(self._controller.session, state)
        if message != self._sent_text:
            self._sent_text = message
            await self._send(message)

    async def _send_drawn(self, state: State, view: View) -> None:
        """Send what the panes show and the page lacks: vectors, then the pictures made meanwhile.

        The page holds vectors until the pictures of their frame arrive, never pictures until their vectors arrive.
        """
        pictures = asyncio.create_task(self._pictures.missing(state, view))
        try:
            overlay = await self._overlay.update(state, view)
            if overlay is not None:
                await self._send(overlay)
        finally:
            made = await pictures
        for message in made:
            await self._send(message)

    async def _send_timeline(self, since: int) -> None:
        several = range(len(self._controller.models)) if len(self._controller.models) > 1 else ()
        for person in (None, *several):
            cells = self._controller.stored_poses.timeline(since, person)
            await self._send(await asyncio.to_thread(encoding.timeline, cells, since == 0, person))

    async def _send_checks(self, sent: State | None, state: State) -> None:
        """Send what was found about frames other than the shown one, if it changed."""
        checked = (state.inconsistent_frames, state.keyframe_doubts)
        if sent is None or (sent.inconsistent_frames, sent.keyframe_doubts) != checked:
            await self._send(encoding.inconsistent(state))
        if sent is None or sent.range_comparison is not state.range_comparison:
            await self._send(encoding.range_comparison(state.range_comparison))

    async def _send_epipolar(self, state: State) -> None:
        """Send the lines of the pixel that the page asks about, if they changed."""
        made_from: tuple[object, ...] = (self._epipolar,)
        if self._epipolar:
            shown = tuple(ObjectIdentity(p.values) for p in state.people)
            preview = ObjectIdentity(state.calibration.shown_on(state.frame))
            made_from += (state.frame, shown, state.calibration.n_changes, preview)
        if made_from != self._sent_epipolar:
            self._sent_epipolar = made_from
            await self._send(encoding.epipolar(self._controller.session_of(state), state, self._epipolar))

    async def _send_news(self, state: State, *feeds: Feed) -> None:
        """Send what some feeds have that the page lacks."""
        for feed in feeds:
            if feed.is_due(state, self._view):
                for news in await asyncio.to_thread(feed.updates, self._controller, state):
                    await self._send(news)

    async def _send_history(self) -> None:
        """Send the history to a subscribed page if it changed."""
        if (limit := self._history_limit) == 0:
            return
        entries = await asyncio.to_thread(self._controller.history.entries, limit + 1)
        message = encoding.history(entries, limit)
        if message != self._sent_history:
            self._sent_history = message
            await self._send(message)

    async def _send_presence(self) -> None:
        """Send who is where whenever that changes."""
        async for people in self._presence.changes():
            await self._send(encoding.presence(self._visit, people))

    async def _refuse(self, error: TrackerError) -> None:
        """Tell the page why a message was not carried out, in the words of the page."""
        if isinstance(error, MessageError):
            _LOG.warning("a page sent a wrong message: %s", error)
        await self._notice(MISUNDERSTOOD if isinstance(error, MessageError) else page_text(error))

    async def _notice(self, text: str) -> None:
        await self._send(NoticeMessage("error", text))

    async def _send(self, message: Message | bytes) -> None:
        """Send a text message, or a binary one that is encoded already."""
        if isinstance(message, bytes):
            await self._socket.send_bytes(message)
        else:
            await self._socket.send_str(encode_text(message))


def view_of(message: wire.SetView, n_cameras: int) -> View:
    """Return what a page shows.

    Raises:
        MessageError: the message does not fit the session's cameras.
    """
    reductions = tuple(message.reductions)
    if len(reductions) != n_cameras or any(0 < r < 1 for r in reductions):
        raise MessageError(f"0 or a reduction from 1 to 64 for each of {n_cameras} cameras", str(reductions))
    return View(frozenset(message.layers), reductions, message.by_part)


def _value_names(session: Session) -> list[tuple[str, ...]]:
    """Return the names of the values of each person's poses, by which a page knows joints, parts and limbs."""
    return [p.model.value_names for p in session.people]
