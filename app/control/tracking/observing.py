"""Imported observations: list and show them, judge them by the footage, take them as poses, and import more."""

import threading
from collections.abc import Callable
from dataclasses import replace
from math import inf
from time import monotonic

import numpy as np

from app.control.session.activities import Activities
from app.control.session.background_work import BackgroundWork
from app.control.session.session_state import SessionState
from app.control.tracking.finding import FindingPeople
from app.remedies import page_text
from app.runtime.jobs import StoppedError
from app.state.observations import ObservedSet
from tracker.compute.progress import Report
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.initialization.frame_trials import Trying
from tracker.estimation.tracking.tracker import BackwardStep, PoseEstimate
from tracker.evaluation.judging.judge import judge
from tracker.interchange.detection.detect import DetectionPlan, complete_detection, detect_people, open_name
from tracker.interchange.detection.detector import Detector
from tracker.interchange.detection.detectors import default_folder, load_detector
from tracker.interchange.observations.importing import store_import
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.plans import ImportPlan, ImportRequest, MaskPlan
from tracker.interchange.observations.stored import list_observations, load_observations
from tracker.interchange.plausibility.examine import plan_examined_import
from tracker.pipeline.automatic_run import unplaced
from tracker.pipeline.keypoint_evidence import find_by_keypoints, read_points
from tracker.pipeline.keypoint_poses import imported_changes, poses_of
from tracker.pipeline.track_session import EstimateStep, Step, TrackSession
from tracker.session.session import Session

_DETECTED = "detected"
"""Name of what is detected here."""
_SHOWN_EVERY_S = 1.0
"""Time between two frames that are shown while people are detected on them, seconds."""


class Observing:
    """The imported observations of a session. At most one work on them at a time."""

    def __init__(self, session_state: SessionState, activities: Activities, finding: FindingPeople) -> None:
        """List the observations of the session, in the background.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before poses are stored.
            finding: places people who have no pose yet.
        """
        self._session_state, self._activities, self._finding = session_state, activities, finding
        self._work = BackgroundWork(session_state, "observations", "work on observations")
        self._set = self._work.set
        threading.Thread(target=self._list, name="list observations", daemon=True).start()

    def show(self, name: str) -> None:
        """Show a set in the views; none if the name is empty.

        Raises:
            TrackerError: there is no such set, or it cannot be read.
        """
        self._set(shown=load_observations(self._session_state.session, name) if name else None)

    def judge(self, name: str) -> None:
        """Begin to judge a set by the footage, and show it.

        Raises:
            TrackerError: other work on observations is under way, or the set cannot be read.
        """
        self._begin(name, self._judge)

    def take(self, name: str) -> None:
        """Begin to store a set as poses, as one entry of the history. Keyframes stay.

        Raises:
            TrackerError: other work on observations is under way, or the set cannot be read.
        """
        self._begin(name, self._take)

    def track(self, name: str, as_evidence: bool) -> None:
        """Begin to find who has no pose by the key points of a set, and to track everybody; `FindingPeople` does it.

        Args:
            name: of the set, which is shown.
            as_evidence: whether the key points are evidence of the run, beside the contours.

        Raises:
            TrackerError: other work is under way, or the set cannot be read.
        """
        with self._session_state.lock:
            shown = self._free_to_use(name)
            self._finding.start(of=name, as_evidence=as_evidence)
            self._set(shown=shown, plan=None, message="", failed=False)

    def detect(self, then_track: bool = False) -> None:
        """Begin to detect people by a network on all frames; what is found is shown and stored.

        Args:
            then_track: whether who has no pose is found by their key points afterwards, and everybody tracked; then
                what was detected before is used. See `track`.

        Raises:
            TrackerError: other work on observations is under way.
        """
        with self._session_state.lock:
            self._work.require_free()
            self._start(_DETECTED, self._detect_and_track if then_track else self._detect)

    def stop(self) -> None:
        """Stop the work; only people who were detected by then are stored. The caller must not hold the lock."""
        self._work.stop()

    def plan(self, request: ImportRequest) -> ImportPlan | MaskPlan:
        """Read and check files, and show their points in the views. Nothing is stored.

        Raises:
            TrackerError: they cannot be read, or are of no camera of the session.
        """
        self.discard()
        plan = plan_examined_import(self._session_state.session, request)
        self._set(plan=plan, message="", failed=False)
        return plan

    def discard(self) -> None:
        """Forget the files that were read last."""
        self._set(plan=None)

    def store(self) -> None:
        """Store the files that were read last with the session, and show them.

        Raises:
            TrackerError: there are none, they contradict the session, or the set cannot be written.
        """
        plan = self._session_state.state.observations.plan
        if plan is None:
            raise TrackerError("expected files that have been read, found none; check the files first")
        if isinstance(plan, MaskPlan):
            self._store_masks(plan)
            return
        store_import(self._session_state.session, plan)
        self._list()
        self._set(plan=None, shown=plan.observations, message=f"Imported {plan.observations.name}.", failed=False)

    def _store_masks(self, plan: MaskPlan) -> None:
        """Store masks, and continue with cameras that use them; evidence without them is dropped."""
        with self._activities.editing(alone=True):
            session_state = self._session_state
            session_state.set_cameras(store_import(session_state.session, plan))
            session_state.saver.follow_session(session_state.session)
            self._set(plan=None, message=f"The cameras use the masks of {plan.name} as silhouettes.", failed=False)
            session_state.show_frame()

    def _list(self) -> None:
        session = self._session_state.session
        self._set(sets=tuple(_described(session, name) for name in list_observations(session)))

    def _begin(self, name: str, work: Callable[[str], str]) -> None:
        with self._session_state.lock:
            self._set(shown=self._free_to_use(name))
            self._start(name, work)

    def _start(self, name: str, work: Callable[[str], str]) -> None:
        begin = replace(self._work.state, plan=None, share=0.0, message="", failed=False)
        self._work.start(lambda: {"message": work(name)}, begin)

    def _free_to_use(self, name: str) -> ObservationSet:
        """Return a set of which no work is under way.

        Raises:
            TrackerError: some is, or it cannot be read.
        """
        self._work.require_free()
        return load_observations(self._session_state.session, name)

    def _detect(self, name: str) -> str:
        detector, text = load_detector("blazepose", None, default_folder())
        return self._detected(name, detector, text)[0]

    def _detect_and_track(self, name: str) -> str:
        session = self._session_state.session
        detector, text = load_detector("blazepose", None, default_folder())
        message, of = "", complete_detection(session, text, range(session.n_frames))
        if of is None:
            message, of = self._detected(name, detector, text)
        if of is not None:
            self._finding.start(of=of, as_evidence=True)
        return message

    def _detected(self, name: str, detector: Detector, text: str) -> tuple[str, str | None]:
        """Detect people; return a sentence on it, and the name of the observations, None if it was stopped."""
        session, recording = self._session_state.session, self._session_state.frames.observer.recording
        frames = range(session.n_frames)
        plan = DetectionPlan(open_name(session, name, text, frames), text, frames)

        def report(stage: str, share: float, text: str = "", /) -> None:
            try:
                self._work.report(stage, share)
            except StoppedError:
                raise KeyboardInterrupt from None

        shown, at_s = self._session_state.state.frame, -inf

        def show(frame: int, seen: Callable[[], ObservationSet]) -> None:
            nonlocal shown, at_s
            with self._session_state.lock:
                state = self._session_state.state
                if state.frame != shown or state.drag is not None or monotonic() - at_s < _SHOWN_EVERY_S:
                    return
                shown, at_s = frame, monotonic()
                self._session_state.show_frame(frame=frame, observations=replace(state.observations, shown=seen()))

        try:
            found = detect_people(session, recording, detector, plan, report, show)
        except TrackerError:
            self._set(shown=None)  # nothing of it was stored
            raise
        self._list()
        self._set(shown=load_observations(session, plan.name))
        ended = "" if found.is_complete else "Stopped; what was found is kept, and Detect people goes on. "
        n = found.frames.stop - found.frames.start
        message = ended + f"Detected people on {n} frames. {' '.join(f'Note: {note}.' for note in found.notes)}"
        return message.strip(), plan.name if found.is_complete else None

    def _judge(self, name: str) -> str:
        session, observer = self._session_state.session, self._session_state.frames.observer.at_nearest_times()
        found = judge(session, observer, name, TrackSettings(), _ShownProgress(self._work.report), self._work.report)
        self._set(judged=name, judgements=tuple(found))
        return ""

    def _take(self, name: str) -> str:
        session_state = self._session_state
        session, edit = session_state.session, None
        known = read_points(session, name)
        missing = [i for i in unplaced(self._finding, range(len(session.people))) if i in known]
        first = find_by_keypoints(session, missing, range(session.n_frames), name) if missing else None
        bodies = {} if first is None else {i: p.model for i, p in first.poses.items()}
        sized = replace(
            session, people=tuple(replace(p, model=bodies.get(i, p.model)) for i, p in enumerate(session.people))
        )
        found = poses_of(sized, tuple(known), name, self._work.report)
        self._work.report("storing", 1.0)
        label = f"poses of {name}"
        if not any(found.values()):
            raise TrackerError(
                f"expected a frame with four joints of a person in '{name}', found none; import other files"
            )
        with self._activities.editing():
            saver = session_state.saver
            if first is not None:
                edit = self._finding.place(first, label)
            changes = [
                change
                for i, poses in found.items()
                for change in imported_changes(session.people[i].name, poses, saver.revisions.current(i), name)
            ]
            saver.write(label, changes, edit, by_program=True)
            session_state.refresh_saving()
            session_state.show_frame()
        return f"Stored poses on {len(set().union(*found.values()))} frames; keyframes stayed. Undo takes them back."


class _ShownProgress:
    """The sink of a judgement, whose poses are stored elsewhere and not shown."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self._n_tracked = 0

    def show(self, trying: Trying) -> None:
        """See `Sink.show`."""

    def take(self, run: TrackSession, step: Step) -> None:
        """See `Sink.take`."""
        if isinstance(step, PoseEstimate):
            self._n_tracked += 1
            self.report("tracking", min(1.0, self._n_tracked / max(1, len(run.frames))))
        elif isinstance(step, BackwardStep):
            self.report("tracking backward", step.done / step.total)
        elif isinstance(step, EstimateStep):
            self.report("estimating all frames together", step.done / step.total)


def _described(session: Session, name: str) -> ObservedSet:
    try:
        found = load_observations(session, name)
    except TrackerError as error:
        return ObservedSet(name, problem=page_text(error))
    return ObservedSet(name, found.format, found.people, found.points is None, _n_frames(found))


def _n_frames(found: ObservationSet) -> int:
    """Return the number of frames with points."""
    if found.points is not None:
        return int(found.points.is_known.any(axis=(1, 2, 3)).sum())
    assert found.joints is not None
    joints = found.joints.joints_world.reshape(found.joints.n_frames, -1)
    return int(np.count_nonzero(np.isfinite(joints).any(axis=1)))
