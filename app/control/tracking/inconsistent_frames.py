"""Keeps the list of frames that disagree with their neighbours up to date, in the background."""

from collections.abc import Iterable

import numpy as np

from app.control.session.session_state import Screen
from app.runtime.jobs import Latest
from app.state.state import State
from tracker.motion.consistency import inconsistent_frames

_REST_S = 0.3
"""A tracker writes twice a second: no need to look more often."""
_REACH = 3
"""A changed pose changes the opinion of frames this far from it."""
_AT_ONCE = 2000
"""Frames looked at together."""


class Disagreements:
    """Looks at every frame once, then at what changes. Publishes to the screen's state."""

    def __init__(self, screen: Screen) -> None:
        """Begin to look."""
        self._screen = screen
        self._found: list[set[int]] = [set() for _ in screen.models]
        self._seen = 0  # version of the timeline
        self._latest: Latest[int] = Latest(self._look, "disagreements", _REST_S)
        self._offered = 0
        screen.subscribe(self._changed)
        self._changed(screen.state)

    def close(self) -> None:
        """Look no more."""
        self._latest.close()

    def _changed(self, state: State) -> None:
        if state.timeline_version != self._offered:
            self._offered = state.timeline_version
            self._latest.offer(state.timeline_version)

    def _look(self, version: int) -> None:
        screen = self._screen
        with screen.lock:
            changed = sorted(screen.saver.timeline(self._seen))
        self._seen = version
        for first, last in _stretches(changed):
            for person in range(len(screen.models)):
                self._look_at(person, first, last)
        found = tuple(sorted(set().union(*self._found)))
        with screen.lock:
            if found != screen.state.disagreeing:
                screen.set(disagreeing=found)

    def _look_at(self, person: int, first: int, last: int) -> None:
        """Look anew at a stretch of frames of one person."""
        screen = self._screen
        around = range(max(0, first - 2 * _REACH), last + 2 * _REACH + 1)
        rows = [r for r in screen.saver.numbers(person, around) if screen.saver.fits(person, r.model_revision)]
        models = [screen.saver.body(r.model_revision) for r in rows]
        keyframes = {r.frame for r in screen.saver.rows(person, around) if r.keyframe}
        values = np.array([r.values for r in rows])
        off = inconsistent_frames(models, [r.frame for r in rows], values, keyframes, screen.session.fps)
        touched = range(max(0, first - _REACH), last + _REACH + 1)
        known = self._found[person]
        known -= {f for f in known if f in touched}
        known |= {f for f in off if f in touched}


def _stretches(frames: Iterable[int]) -> Iterable[tuple[int, int]]:
    """First and last frames of stretches that hold all given frames, ascending; neighbours are looked at together."""
    first = last = None
    for frame in frames:
        if first is None or last is None:
            first = last = frame
        elif frame - last <= 2 * _REACH and frame - first < _AT_ONCE:
            last = frame
        else:
            yield first, last
            first = last = frame
    if first is not None and last is not None:
        yield first, last
