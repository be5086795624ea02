"""Messages of one page that wait to be carried out: few, in order, and only the newest of those that replace others."""

import asyncio
from collections import deque

from app.messages import client as wire
from app.messages.observation import WatchProvenance
from app.messages.search import PreviewCandidate, ReplayStep, SetSearchSpeed
from tracker.errors import TrackerError

MAX_WAITING = 256
"""Messages that wait at most: a held key repeats 30 times a second, so these are 8 s of it with none carried out."""
MAX_HELD_UP = 64
"""Messages in a row that may have to wait for a place before the page is taken for a flood."""
COALESCED = (wire.Seek, wire.SetView, wire.CheckEpipolar, WatchProvenance, ReplayStep, PreviewCandidate, SetSearchSpeed)
"""Messages of which only the newest in the queue is carried out."""


class FloodError(TrackerError):
    """A page that sends faster than its messages can be carried out, and goes on."""


class Inbox:
    """The queue of a page. Used in the thread of the event loop."""

    def __init__(self, has_limit: bool) -> None:
        """Begin empty.

        Args:
            has_limit: whether a page that goes on while the queue is full is refused; otherwise it only waits.
        """
        self._has_limit = has_limit
        self._waiting: deque[wire.ClientMessage | TrackerError] = deque()
        self._arrived, self._has_place = asyncio.Event(), asyncio.Event()
        self._n_held_up = 0

    def __len__(self) -> int:
        """Return the number of messages that wait."""
        return len(self._waiting)

    async def put(self, message: wire.ClientMessage | TrackerError) -> None:
        """Add a message, or why one is refused. A newer seek, or a newer move of a drag, replaces one that waits.

        Waits while the queue is full, so that nothing more is read from the page.

        Raises:
            FloodError: the queue has been full for too many messages, and was never empty meanwhile.
        """
        if self._waiting and _replaces(self._waiting[-1], message):
            self._waiting[-1] = message
            await asyncio.sleep(0)  # others have a turn between two of them, too
            return
        if len(self._waiting) >= MAX_WAITING:
            self._n_held_up += 1
            if self._has_limit and self._n_held_up > MAX_HELD_UP:
                self._waiting.clear()
                raise FloodError(
                    f"expected at most {MAX_WAITING} messages that wait, found a page that sends more without pause; "
                    "send fewer"
                )
            while len(self._waiting) >= MAX_WAITING:
                self._has_place.clear()
                await self._has_place.wait()
        self._waiting.append(message)
        self._arrived.set()

    async def take(self) -> wire.ClientMessage | TrackerError:
        """Return the next message, and wait for it if there is none."""
        while not self._waiting:
            self._n_held_up = 0
            self._arrived.clear()
            await self._arrived.wait()
        self._has_place.set()
        return self._waiting.popleft()


def _replaces(last: wire.ClientMessage | TrackerError, message: wire.ClientMessage | TrackerError) -> bool:
    """Return whether a message makes the one before it superfluous."""
    is_move = getattr(last, "phase", None) == getattr(message, "phase", None) == "move"
    return type(last) is type(message) and (is_move or isinstance(message, COALESCED))
