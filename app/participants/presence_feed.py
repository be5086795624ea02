"""Tell a page who is where, when that changes and not too often."""

import asyncio
from collections.abc import AsyncIterator

from app.participants.participants import Participants, Presence

_REST_S = 0.2
"""Time between two messages: nobody follows the frames of a playing page faster."""


class PresenceFeed:
    """Watches who is on a session, for one page. Made and used in the thread of the event loop."""

    def __init__(self, participants: Participants) -> None:
        """Begin to watch."""
        self._participants, self._changed = participants, asyncio.Event()
        self._changed.set()
        self._loop = asyncio.get_running_loop()
        self._unsubscribe = participants.subscribe(self._wake)

    def close(self) -> None:
        """Watch no more."""
        self._unsubscribe()

    async def changes(self) -> AsyncIterator[tuple[Presence, ...]]:
        """Yield who is where: now, and after each change."""
        last: tuple[Presence, ...] | None = None
        while True:
            await self._changed.wait()
            self._changed.clear()
            found = await asyncio.to_thread(self._participants.present)
            if found != last:
                last = found
                yield found
                await asyncio.sleep(_REST_S)

    def _wake(self) -> None:
        """Note a change; called from any thread."""
        if not self._changed.is_set():
            self._loop.call_soon_threadsafe(self._changed.set)
