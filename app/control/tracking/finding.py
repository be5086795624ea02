"""Find people whom nobody has placed, acquire their sizes and track them: one job, and one entry of the history."""

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from app.control.search.search_runs import SearchRuns
from app.control.session.activities import Activities
from app.control.session.background_work import BackgroundWork, failure
from app.control.session.session_state import SessionState
from app.control.tracking import track_settings
from app.control.tracking.tracking import Tracking
from app.runtime.jobs import StoppedError
from app.state.progress import CHAIN_STEPS, FindState, Line
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.estimation.initialization.first_pose import FirstPoses
from tracker.estimation.initialization.frame_trials import TakenError, Trying
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import format_model
from tracker.pipeline.automatic_run import ACQUIRING, ChainPlan, Sink, find_and_track, unplaced
from tracker.pipeline.body_acquisition import SIZES_EDITS, resized_start, with_sizes_changed
from tracker.pipeline.find_people import AXES, FindSettings, axes_record, first_record
from tracker.pipeline.keypoint_evidence import read_points, stored_seen_bodies, with_keypoints
from tracker.pipeline.stored_run import TrackPlan
from tracker.pipeline.track_session import Step, TrackSession
from tracker.session.session import Session, save_model
from tracker.session.store.records import PoseChange, PoseRecord
from tracker.session.store.stored_poses import StoredPose

_ENDED: dict[str, Any] = {"candidates": {}, "sought": frozenset(), "takable": None, "trying": "", "left_s": None}
"""Fields of a search that found nobody."""


class FindingPeople:
    """At most one search for people at a time. Until it has found them it changes nothing."""

    def __init__(
        self, session_state: SessionState, activities: Activities, tracking: Tracking, runs: SearchRuns
    ) -> None:
        """Find nobody yet; show the axes of the silhouettes that were found before.

        Args:
            session_state: holds the state.
            activities: ends searches and gestures before poses are stored.
            tracking: tracks the people who were found.
            runs: recorded searches, which end where sizes change.
        """
        self._session_state, self._activities, self._tracking, self._runs = session_state, activities, tracking, runs
        self._work = BackgroundWork(session_state, "finding", "search for people")
        self._set = self._work.set
        self._edit: int | None = None
        """Entry of the history with the people who were found; None before."""
        self._shown: int | None = None
        """Frame at which the user is shown what is tried; another frame is one that the user has gone to."""
        self._first_tried: int | None = None
        self._is_taken = threading.Event()
        self._best: FirstPoses | None = None
        frame, axes = _axes(session_state.saver.setting(AXES))
        session_state.set(finding=FindState(frame=frame, axes=axes))

    def start(self, acquire: bool = True, of: str | None = None, as_evidence: bool = False) -> None:
        """Begin to find the people who have no pose, and track everybody.

        Args:
            acquire: whether sizes of those who are found are acquired from the contours.
            of: observations whose key points show the first poses; everybody may be placed already then. None for
                silhouettes.
            as_evidence: whether these key points are evidence of the run, too.

        Raises:
            TrackerError: a search for people is at work, or everybody is placed.
        """
        session_state = self._session_state
        with session_state.lock:
            self._work.require_free()
            people = unplaced(self, range(len(session_state.present)))
            if not people and of is None:
                raise TrackerError(
                    "expected a person without a pose, found that all are placed; track from here, or clear a "
                    "person's frames first"
                )
            before = session_state.state.finding
            self._shown, self._first_tried, self._edit = session_state.state.frame, None, None
            settings = track_settings.of_run(session_state.state.settings, session_state.state.run_choices)
            everybody, frames = tuple(range(len(session_state.present))), range(session_state.session.n_frames)
            track = TrackPlan(frames, everybody, settings, keypoints=of if as_evidence else None)
            plan = ChainPlan(track, FindSettings(keypoints=of), people if acquire else ())
            self._best = None
            self._is_taken.clear()
            steps = tuple(step for step in CHAIN_STEPS if acquire or step != "sizes")
            begin = FindState(sought=frozenset(people), frame=before.frame, axes=before.axes, steps=steps)
            self._work.start(lambda: self._run(plan), begin)

    def stop(self) -> None:
        """Stop the work; what was stored stays. The caller must not hold the lock."""
        self._work.stop(before_waiting=self._tracking.stop)

    def take_best(self) -> None:
        """End the search with the best poses so far, and go on with them.

        Raises:
            TrackerError: there are none that are credible.
        """
        if self._work.state.takable is None:
            raise TrackerError("expected a pose that can be taken, found none; wait until a frame shows one")
        self._is_taken.set()

    def _run(self, plan: ChainPlan) -> dict[str, Any]:
        try:
            find_and_track(plan, self, self)
        except StoppedError:
            message = "Stopped; nothing was changed." if self._edit is None else "Stopped; what was found stays."
            return {**_ENDED, "message": message, "tried": None}
        except Exception as error:
            return self._failed(error)
        return {"message": "Done."}

    @property
    def session(self) -> Session:
        """See `OpenSession.session`."""
        return self._session_state.session

    @property
    def observer(self) -> Observer:
        """See `OpenSession.observer`."""
        return self._session_state.frames.observer.at_nearest_times()

    def sources(self, person: int) -> Mapping[int, str]:
        """See `OpenSession.sources`."""
        return {row.frame: row.source for row in self._session_state.saver.rows(person, range(self.session.n_frames))}

    def setting(self, name: str, default: Any) -> Any:
        """See `OpenSession.setting`."""
        return self._session_state.saver.setting(name, default)

    def store_setting(self, name: str, value: Any) -> None:
        """See `OpenSession.store_setting`."""
        self._session_state.saver.store_setting(name, value)

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """See `Sink.report`."""
        self._work.report(stage, share)
        step = "sizes" if stage == ACQUIRING else "find"
        if step != self._work.state.step:
            self._set(step=step)
        if text:
            self._set(notes=(*self._work.state.notes, text))

    def show(self, trying: Trying) -> None:
        """See `Sink.show`: draw the best first poses so far, and go there unless the user looks or works elsewhere.

        Raises:
            TakenError: the user takes them.
        """
        session_state, best = self._session_state, trying.best
        if self._is_taken.is_set() and best is not None:
            raise TakenError
        self._first_tried = trying.frame if self._first_tried is None else self._first_tried
        with session_state.lock:
            state = session_state.state
            candidates = state.finding.candidates
            if best is not None and best is not self._best:
                candidates = {best.frame: {i: p.start.body for i, p in best.poses.items()}}
            self._best = best
            takable = best.frame if best is not None and best.is_credible else None
            left_s = None if trying.left_s is None else math.ceil(trying.left_s)
            finding = replace(
                state.finding, trying=trying.text, tried=trying.frame, takable=takable, left_s=left_s,
                candidates=candidates,
            )  # fmt: skip
            frame = trying.frame if best is None else best.frame
            if frame is not None and self._is_watched() and state.frame != frame:
                self._shown = frame
                session_state.show_frame(frame=frame, finding=finding)
            elif finding != state.finding:
                session_state.set(finding=finding)

    def _failed(self, error: Exception) -> dict[str, Any]:
        """Go to the frame that an error is about if the user still watches."""
        frame, names = self._first_tried, [c.camera.name for c in self.session.cameras]
        named = error.camera if isinstance(error, TrackerError) else None
        with self._session_state.lock:
            if frame is not None and self._is_watched() and frame != self._shown:
                self._session_state.show_frame(frame=frame)
        return {**_ENDED, **failure(error), "tried": frame, "camera": names.index(named) if named in names else None}

    def _is_watched(self) -> bool:
        """Return whether the user has stayed where the search shows what it does, and is not at work there."""
        state = self._session_state.state
        return state.frame == self._shown and state.drag is None and not state.search.running

    def store_found(self, found: FirstPoses, label: str = "find people") -> None:
        """See `OpenSession.store_found`: store people and bodies as one entry of the history, and show them.

        Args:
            found: the people.
            label: of the entry.

        Raises:
            TrackerError: somebody was placed meanwhile, or a body cannot be written.
        """
        with self._activities.editing():
            if not set(found.poses) <= set(unplaced(self, range(len(self._session_state.present)))):
                raise TrackerError(
                    "expected nobody to be placed meanwhile, found a new pose; what was found is discarded"
                )
            records = {i: partial(first_record, first) for i, first in found.poses.items()}
            self._store(found.frame, {i: first.model for i, first in found.poses.items()}, records, label)
            axes = axes_record(found)
            self._session_state.saver.store_setting(AXES, axes)
            frame, lines = _axes(axes)
            finding = replace(self._session_state.state.finding, frame=frame, axes=lines, tried=None, **_ENDED)
            self._session_state.show_frame(frame=found.frame, finding=finding)

    def place(self, found: FirstPoses, label: str) -> int | None:
        """Store people who were found otherwise; return the new entry of the history, to add to."""
        with self._activities.editing():
            self._edit = None
            self.store_found(found, label)
            return self._edit

    def store_body(self, person: int, acquired: Acquisition, start: int) -> None:
        """See `OpenSession.store_body`: it belongs to the same entry of the history, unless there is a later one.

        Raises:
            TrackerError: the pose or the sizes were changed meanwhile, or the body cannot be written.
        """
        with self._activities.editing():
            saver, name = self._session_state.saver, self._session_state.session.people[person].name
            record, revision = saver.record(person, start), saver.revisions.current(person)
            if record is None or record.keyframe or record.model_revision != revision:
                raise TrackerError(
                    f"expected {name} as found on frame {start}, found another pose or other sizes; the acquired sizes "
                    "are discarded; track from here"
                )
            stored = StoredPose(PosedBody(self._session_state.present[person], record.values), record)
            resized = partial(resized_start, stored, acquired.body)
            self._store(start, {person: acquired.body}, {person: resized}, "find people")
            if self._session_state.state.frame == start:
                self._session_state.show_frame(frame=start)

    def _store(
        self, frame: int, bodies: Mapping[int, BodyModel], records: Mapping[int, Callable[[int], PoseRecord]],
        label: str,
    ) -> None:  # fmt: skip
        """Store bodies, and poses on a frame, in the entry of the history of this search; the caller is editing.

        Args:
            frame: number of the frame.
            bodies: by person.
            records: by person, returns the pose for the revision of the body.
            label: of the entry, where it is a new one.
        """
        session_state, saver = self._session_state, self._session_state.saver
        sizes, changes = [], []
        for person, body in bodies.items():
            who, before = session_state.session.people[person], saver.revisions.current(person)
            if format_model(body) != format_model(who.model):
                session_state.set_body_models(save_model(session_state.session, person, body))
            revision = saver.revisions.current(person)
            changes.append(PoseChange(who.name, frame, records[person](revision)))
            if revision != before:
                sizes.append((who.name, before, revision))
        edit = self._edit = saver.write(label, changes, self._entry(), by_program=False)
        if edit is not None and sizes:
            saver.store_setting(SIZES_EDITS, with_sizes_changed(saver.setting(SIZES_EDITS, {}), edit, sizes))
            self._runs.clear()
        session_state.refresh_saving()

    def _entry(self) -> int | None:
        """Return the entry of the history of this search if further changes can be added to it: if it is the latest."""
        latest = next((e.edit for e in self._session_state.saver.moves.entries(1) if not e.undone), None)
        return self._edit if self._edit == latest else None

    def outdated_sizes(self) -> list[str]:
        """See `OpenSession.outdated_sizes`: people are found by the present calibration."""
        return []

    def is_interrupted(self, plan: TrackPlan) -> bool:
        """See `OpenSession.is_interrupted`; in the page a run that was stopped is over."""
        return False

    def track(self, plan: TrackPlan, sink: Sink) -> TrackPlan:
        """See `OpenSession.track`. The run can be paused; it is shown like any other, so that the sink gets no step."""
        assert plan.start is not None
        ended, outcome, observer = threading.Event(), list[bool](), self._tracking.observer()
        if plan.keypoints is not None:
            saver: Any = self._session_state.saver  # reads settings as the store does
            seen = stored_seen_bodies(self.session, saver, plan.keypoints)
            observer = with_keypoints(self.session, observer, read_points(self.session, plan.keypoints), seen)

        def on_end(is_done: bool) -> None:
            outcome.append(is_done)
            ended.set()

        self._tracking.start_outward(plan.start, plan.people, self._entry(), on_end, observer=observer)
        ended.wait()
        if not outcome[0]:
            raise StoppedError
        return plan

    def take(self, run: TrackSession, step: Step) -> None:
        """See `Sink.take`."""


def _axes(record: Mapping[str, Any] | None) -> tuple[int | None, dict[str, tuple[tuple[Line, ...], ...]]]:
    """Return the frame and the lines of the setting `AXES`; nobody's where it is missing."""
    if record is None:
        return None, {}
    lines = {
        camera: tuple(tuple((a[0], a[1], b[0], b[1]) for a, b in own) for own in people)
        for camera, people in record["lines"].items()
    }
    return int(record["frame"]), lines
