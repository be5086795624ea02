"""Compare the poses of a range of frames with those that they replaced, such as those of another tracker.

Tell on which frames a tracking run is better or worse than the poses that it replaced.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.comparison import ComparedPose, RangeComparison, Stretch, Verdict
from app.state.state import State
from tracker.body.limbs import display_name
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.pipeline.methods import METHODS
from tracker.pipeline.tracked_changes import recorded_method
from tracker.session.store.records import SOURCES, PoseRecord

_REST_S = 0.3
"""Minimum time between two comparisons: a tracker writes twice a second."""


class ComparingRuns:
    """Compares one range at a time. The comparison follows every edit."""

    def __init__(self, session_state: SessionState) -> None:
        """Compare nothing yet."""
        self._session_state = session_state
        self._latest: LatestWinsWorker[range | None] = LatestWinsWorker(self._work, "comparison", _REST_S)
        self._runs = 0
        session_state.subscribe(self._changed, "timeline_version")

    def compare(self, first: int, last: int) -> None:
        """Compare the poses of a range, `last` included, with those before them.

        Raises:
            TrackerError: no pose of the range has replaced another.
        """
        first, last = sorted((first, last))
        found = self._compared(first, last)
        if not any(found.frames):
            raise nothing_replaced(first, last)
        self._session_state.set(range_comparison=found)

    def compare_run(self, frames: range) -> None:
        """Compare the poses of a run that has just ended with those that it replaced, in the background.

        Nothing happens if none is better or worse.
        """
        self._latest.offer(frames, key="run")

    def leave(self) -> None:
        """End the comparison."""
        self._session_state.set(range_comparison=None)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _changed(self, state: State) -> None:
        if state.range_comparison is not None:
            self._latest.offer(None)

    def _work(self, run: range | None) -> None:
        if run is None:
            self._refresh()
            return
        found = self._compared(run.start, run[-1], with_keyframes=False)
        if found.stretches:
            self._runs += 1
            self._session_state.set(range_comparison=replace(found, run=self._runs))

    def _refresh(self) -> None:
        before = self._session_state.state.range_comparison
        if before is None:
            return
        found = self._compared(before.first, before.last, with_keyframes=before.run is None)
        if before.run is not None:  # poses that were taken back are no gain of the run
            found = replace(found, stretches=before.stretches, run=before.run)
        with self._session_state.lock:
            if self._session_state.state.range_comparison is before:
                self._session_state.set(range_comparison=found)

    def _compared(self, first: int, last: int, with_keyframes: bool = True) -> RangeComparison:
        session_state, frames = self._session_state, range(first, last + 1)
        rows, others = list[tuple[ComparedPose, ...]](), dict[int, dict[int, Array]]()
        for person in range(len(session_state.models)):
            of_person = list[ComparedPose]()
            with session_state.lock:
                pairs = session_state.saver.replaced(person, frames)
            for frame, (now, other) in pairs.items():
                if now.keyframe and not with_keyframes:
                    continue
                former = self._in_present_body(person, other)
                of_person.append(self._pose(person, frame, now, other, former))
                others.setdefault(frame, {})[person] = former
            rows.append(tuple(of_person))
        found = tuple(one for person, poses in enumerate(rows) for one in stretches(person, poses))
        return RangeComparison(first, last, tuple(rows), others, found)

    def _pose(self, person: int, frame: int, now: PoseRecord, other: PoseRecord, former: Array) -> ComparedPose:
        """Compare a stored pose with another, which has the values `former`, (n_values,), in the present body."""
        model = self._session_state.session.people[person].model
        present = self._in_present_body(person, now)
        apart_mm = 1000 * np.linalg.norm(model.points_world(present) - model.points_world(former), axis=1)
        at = int(apart_mm.argmax())
        return ComparedPose(
            frame, method_of(now), method_of(other), now.cost_px, other.cost_px, now.status, other.status,
            float(apart_mm.mean()), float(apart_mm[at]), display_name(model.point_names[at]),
        )  # fmt: skip

    def _in_present_body(self, person: int, record: PoseRecord) -> Array:
        return self._session_state.saver.revisions.in_present_body(person, record.values, record.model_revision)


def nothing_replaced(first: int, last: int) -> TrackerError:
    """Return the error that no pose of a range, `last` included, has replaced another."""
    return TrackerError(
        f"expected frames among {first} to {last} whose pose replaced another, found none; "
        "track them again by another method first"
    )


def method_of(record: PoseRecord) -> str:
    """Return how a pose was made, as text: the tracker's method, otherwise the most manual source of its values."""
    source = min(record.sources, key=SOURCES.index)
    return recorded_method(record.settings) if source == "tracked" else source


_SAME_MM = 10.0
"""Largest distance between the joints of two poses that count as the same, mm: smoothing moves them by as much."""
_SAME_SHARE = 0.03
"""Costs that differ by less are as good as each other. Starts of a track are ambiguous below it, too."""
_GAP = 3
"""Largest number of frames between two parts of a stretch in which neither pose is better."""
_BADNESS = {"good": 0, "doubtful": 1, "lost": 2}


def verdict(pose: ComparedPose) -> Verdict:
    """Judge a pose against the one that it replaced: by the statuses, or by the costs where these agree.

    Costs of poses that were made by hand say nothing here: they were measured against other edges than a tracker's.
    """
    if pose.farthest_mm < _SAME_MM:
        return "same"
    now, other = _BADNESS.get(pose.status), _BADNESS.get(pose.other_status)
    if now is not None and other is not None and now != other:
        return "better" if now < other else "worse"
    is_tracked = pose.method in METHODS and pose.other_method in METHODS
    if not is_tracked or pose.cost_px is None or pose.other_cost_px is None:
        return "same"
    if abs(pose.cost_px - pose.other_cost_px) <= _SAME_SHARE * max(pose.cost_px, pose.other_cost_px):
        return "same"
    return "better" if pose.cost_px < pose.other_cost_px else "worse"


def stretches(person: int, poses: Sequence[ComparedPose]) -> tuple[Stretch, ...]:
    """Return the stretches of frames on which the present poses of a person are better or worse, ascending.

    Args:
        person: index of the person.
        poses: of the person, by ascending frame.
    """
    found: list[Stretch] = []
    for pose in poses:
        kind = verdict(pose)
        last = found[-1] if found else None
        if kind == "same":
            continue
        if last is not None and last.verdict == kind and pose.frame - last.last <= _GAP + 1:
            found[-1] = replace(last, last=pose.frame, frames=last.frames + 1)
        else:
            found.append(Stretch(person, pose.frame, pose.frame, 1, kind))
    return tuple(found)
