"""Find the frames whose poses disagree with their neighbours, in the background."""

import time
from collections.abc import Iterable
from itertools import product

import numpy as np

from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.state import State
from tracker.motion.consistency import inconsistent_frames

_REST_S = 0.3
"""Minimum time between two checks: a tracker writes twice a second."""
_REST_SHARE = 3.0
"""Rest after an interval of many, in the time that it took. Each query of an edit gives up the interpreter, and waits
for it again while a check computes: beside a check without rests, the first edits in a long recording took seconds."""
_REACH = 3
"""A changed pose affects the result of frames up to this distance."""
_MAX_INTERVAL = 2000
"""Maximum number of frames checked together."""


class InconsistentFrames:
    """Checks every frame once, then changed frames. The state holds the result."""

    def __init__(self, session_state: SessionState) -> None:
        """Start to check."""
        self._session_state = session_state
        self._found: list[set[int]] = [set() for _ in session_state.models]
        self._seen = 0  # checked version of the timeline
        self._latest: LatestWinsWorker[int] = LatestWinsWorker(self._check, "disagreements", _REST_S)
        self._offered = 0
        session_state.subscribe(self._changed)
        self._changed(session_state.state)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _changed(self, state: State) -> None:
        if state.timeline_version != self._offered:
            self._offered = state.timeline_version
            self._latest.offer(state.timeline_version)

    def _check(self, version: int) -> None:
        session_state = self._session_state
        with session_state.lock:
            changed = sorted(session_state.saver.index.timeline(self._seen))
        self._seen = version
        people, took_s = range(len(session_state.models)), 0.0
        for i, (person, (first, last)) in enumerate(product(people, _intervals(changed))):
            if i >= len(people):  # a long recording, not an edit
                time.sleep(_REST_SHARE * took_s)
            began_s = time.monotonic()
            self._check_interval(person, first, last)
            took_s = time.monotonic() - began_s
        found = tuple(sorted(set().union(*self._found)))
        with session_state.lock:
            if found != session_state.state.inconsistent_frames:
                session_state.set(inconsistent_frames=found)

    def _check_interval(self, person: int, first: int, last: int) -> None:
        """Check an interval of frames of one person."""
        saver = self._session_state.saver
        around = range(max(0, first - 2 * _REACH), last + 2 * _REACH + 1)
        rows = [
            r
            for r in self._session_state.saver.pose_rows(person, around)
            if self._session_state.saver.revisions.fits(person, r.model_revision)
        ]
        models = [saver.revisions.body(r.model_revision) for r in rows]
        keyframes = {r.frame for r in saver.rows(person, around) if r.keyframe}
        values = np.array([r.values for r in rows])
        off = inconsistent_frames(models, [r.frame for r in rows], values, keyframes, self._session_state.session.fps)
        touched = range(max(0, first - _REACH), last + _REACH + 1)
        known = self._found[person]
        known -= {f for f in known if f in touched}
        known |= {f for f in off if f in touched}


def _intervals(frames: Iterable[int]) -> Iterable[tuple[int, int]]:
    """Yield first and last frames of intervals that contain all given frames, ascending, joining near ones."""
    first = last = None
    for frame in frames:
        if first is None or last is None:
            first = last = frame
        elif frame - last <= 2 * _REACH and frame - first < _MAX_INTERVAL:
            last = frame
        else:
            yield first, last
            first = last = frame
    if first is not None and last is not None:
        yield first, last
