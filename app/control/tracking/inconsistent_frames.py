"""Find frames whose poses disagree with their neighbours, and keyframes that views contradict, in the background."""

import time
import zlib
from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.people import KeyframeDoubt
from app.state.state import State
from tracker.body.limbs import display_name
from tracker.body.motion.keyframe_doubts import inconsistent_frames, neighbour_gaps, raised_views
from tracker.session.store.records import FramePose, FrameRow

_REST_S = 0.3
"""Minimum time between two checks: a tracker writes twice a second."""
_REST_SHARE = 3.0
"""Rest after an interval of many, in the time that it took. Each query of an edit gives up the interpreter, and waits
for it again while a check computes: beside a check without rests, the first edits in a long recording took seconds."""
_REACH = 3
"""A changed pose affects the result of frames up to this distance."""
_MAX_INTERVAL = 2000
"""Maximum number of frames checked together."""
_CONFIRMED = "confirmed_keyframes"
"""Setting of the session: by person and frame, the checksum of a keyframe's pose that a person has confirmed."""


class InconsistentFrames:
    """Checks every frame once, then changed frames. The state holds the result."""

    def __init__(self, session_state: SessionState) -> None:
        """Start to check."""
        self._session_state = session_state
        self._found: list[set[int]] = [set() for _ in session_state.models]
        self._doubted: list[dict[int, KeyframeDoubt]] = [{} for _ in session_state.models]
        self._seen = 0  # checked version of the timeline
        self._latest: LatestWinsWorker[int] = LatestWinsWorker(self._check, "disagreements", _REST_S)
        session_state.subscribe(self._changed, "timeline_version")
        self._changed(session_state.state)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _changed(self, state: State) -> None:
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
        self._publish()

    def confirm(self, person: int, frame: int) -> None:
        """Keep a keyframe as it is: it is not doubted again until its pose changes.

        Raises:
            TrackerError: the session's settings cannot be written.
        """
        session_state, name = self._session_state, self._session_state.session.people[person].name
        with session_state.lock:
            record = session_state.saver.record(person, frame)
            if record is None or not record.keyframe:
                return
            confirmed = dict(session_state.saver.setting(_CONFIRMED, {}))
            confirmed[name] = {**confirmed.get(name, {}), str(frame): zlib.crc32(record.values.tobytes())}
            session_state.saver.store_setting(_CONFIRMED, confirmed)
        self._doubted[person].pop(frame, None)
        self._publish()

    def _check_interval(self, person: int, first: int, last: int) -> None:
        """Check an interval of frames of one person."""
        saver, fps = self._session_state.saver, self._session_state.session.fps
        reach = max(2 * _REACH, round(fps))
        around = range(max(0, first - reach - _REACH), last + reach + _REACH + 1)
        rows = [r for r in saver.pose_rows(person, around) if saver.revisions.fits(person, r.model_revision)]
        models = [saver.revisions.body(r.model_revision) for r in rows]
        summaries = saver.rows(person, around)
        keyframes = {r.frame for r in summaries if r.keyframe}
        values = np.array([r.values for r in rows])
        off = inconsistent_frames(models, [r.frame for r in rows], values, keyframes, fps)
        touched = range(max(0, first - _REACH), last + _REACH + 1)
        known = self._found[person]
        known -= {f for f in known if f in touched}
        known |= {f for f in off if f in touched}
        judged = range(max(0, first - reach), last + reach + 1)
        doubted = self._doubted[person]
        for frame in [f for f in doubted if f in judged]:
            del doubted[frame]
        doubted |= {d.frame: d for d in self._doubts(person, rows, summaries) if d.frame in judged}

    def _doubts(self, person: int, rows: Sequence[FramePose], summaries: Sequence[FrameRow]) -> Iterable[KeyframeDoubt]:
        """Yield the keyframes among some frames that their neighbours, views or later assessments contradict, but for
        confirmed ones."""
        saver, session = self._session_state.saver, self._session_state.session
        confirmed = saver.setting(_CONFIRMED, {}).get(session.people[person].name, {})
        keyframes = {r.frame: r for r in summaries if r.keyframe}
        undoubted = [r for r in summaries if not r.keyframe and r.status in ("", "good") and r.view_costs_px]
        places = {r.frame: saver.revisions.body(r.model_revision).points_world(r.values) for r in rows}
        gaps = neighbour_gaps(places, keyframes, session.fps)
        for row in rows:
            if row.frame not in keyframes or confirmed.get(str(row.frame)) == zlib.crc32(row.values.tobytes()):
                continue
            gap, body = gaps.get(row.frame), saver.revisions.body(row.model_revision)
            others = [r.view_costs_px for r in undoubted if abs(r.frame - row.frame) <= session.fps]
            summary = keyframes[row.frame]
            views = raised_views(summary.view_costs_px, others)
            is_off = summary.assessed_since and summary.status in ("doubtful", "lost")
            reason = (summary.remark or summary.status) if is_off else ""
            if gap is not None or views or reason:
                point = "" if gap is None else display_name(body.point_names[gap.point])
                yield KeyframeDoubt(person, row.frame, None if gap is None else gap.distance_m, point, views, reason)

    def _publish(self) -> None:
        """Put the result into the state."""
        session_state = self._session_state
        doubts = tuple(doubted[frame] for doubted in self._doubted for frame in sorted(doubted))
        found = set[int]().union(*self._found)
        for doubt in doubts:
            if doubt.distance_m is not None:  # the neighbours jump because of the keyframe
                found = (found - {doubt.frame - 1, doubt.frame + 1}) | {doubt.frame}
        frames = tuple(sorted(found))
        with session_state.lock:
            if (frames, doubts) != (session_state.state.inconsistent_frames, session_state.state.keyframe_doubts):
                session_state.set(inconsistent_frames=frames, keyframe_doubts=doubts)


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
