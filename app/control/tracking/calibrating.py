"""Check the cameras by the contours of the tracked people, preview the corrections, and apply them."""

from typing import Any

import numpy as np

from app.control.session.activities import Activities
from app.control.session.background_work import BackgroundWork
from app.control.session.session_state import SessionState
from app.control.tracking.tracking import Tracking
from app.remedies import page_text
from app.runtime.jobs import LatestWinsWorker
from app.state.calibration import CalibrationState, CorrectedFrame
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.calibration.check.single_frames import score_frame
from tracker.compute.progress import Report
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.geometry.camera_correction import corrected, later_s
from tracker.pipeline.body_acquisition import generic_doubt, with_acquired_bodies
from tracker.pipeline.calibration_check import CalibrationCheck, check_calibration, held_out_scores, n_better
from tracker.pipeline.calibration_revisions import apply_check
from tracker.pipeline.posed_recording import PosedRecording
from tracker.session.session import Session


class Calibrating:
    """At most one check of the cameras at a time. It changes nothing until its corrections are applied."""

    def __init__(self, session_state: SessionState, activities: Activities, tracking: Tracking) -> None:
        """Check nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before the cameras change.
            tracking: tracks again what is of an earlier calibration.
        """
        self._session_state, self._activities, self._tracking = session_state, activities, tracking
        self._work = BackgroundWork(session_state, "calibration", "check of the cameras")
        self._set, self.require_free = self._work.set, self._work.require_free
        self._is_doubt_known = False
        """Whether the last request was answered by the doubt about the bodies."""
        self._version: tuple[int, int] | None = None
        self._tried: tuple[int, int] | None = None  # the check and the frame of the last preview
        self._previews = LatestWinsWorker(self._refit, "calibration preview")
        self._outdated = LatestWinsWorker(self._find_outdated, "earlier calibration")
        fields = ("calibration", "frame", "timeline_version", "track")
        self._unsubscribe = session_state.subscribe(self._follow_state, *fields)
        self._outdated.offer(session_state.state)

    def start(self) -> None:
        """Begin to check the cameras by poses of all frames.

        Bodies in the shape of a preset are acquired for it, at the second request: the first one says so.

        Raises:
            TrackerError: another check is at work.
        """
        doubt = generic_doubt(self._session_state.session)
        self._is_doubt_known = bool(doubt) and not self._is_doubt_known
        if self._is_doubt_known:
            self._work.require_free()
            message = f"{page_text(doubt[:1].upper() + doubt[1:], Remedy('acquire_first'))}."
            self._set(message=message, failed=False)
            return
        before = self._session_state.state.calibration
        begin = CalibrationState(n_changes=before.n_changes, outdated=before.outdated, revision=before.revision)
        self._work.start(self._check, begin)

    def stop(self) -> None:
        """Stop the work. The caller must not hold the lock."""
        self._work.stop()

    def close(self) -> None:
        """Stop all work."""
        self._unsubscribe()
        self.stop()
        self._previews.close()
        self._outdated.close()

    def preview(self, on: bool) -> None:
        """Show people and cameras as the corrections make them, or as they are."""
        if on:
            self._found()
        self._set(is_previewed=on)

    def apply(self) -> None:
        """Correct the cameras that were named, as one entry of the history. Poses stay until they are tracked again.

        Raises:
            TrackerError: nothing is to be corrected, other frames do not confirm it, or it cannot be written.
        """
        check = self._found()
        with self._activities.editing(alone=True):
            session_state, found = self._session_state, self._session_state.state.calibration
            if found.refused:
                raise TrackerError(found.refused)
            corrected_session = session_state.saver.change_cameras(lambda own, store: apply_check(own, store, check))
            message, sizes = f"Corrected: {', '.join(check.named)}.", session_state.saver.outdated_sizes()
            if sizes:
                message += f" Acquire the sizes of {', '.join(sizes)} again, which fit the former cameras, then track."
            self.exchange_cameras(corrected_session, message)

    def track_again(self) -> None:
        """Track the frames again on which somebody has a pose of an earlier calibration. Keyframes stay.

        The run covers the frames from the first such pose to the last, keyframes included. It goes out from the
        keyframe in its middle, or else from its first pose, which is tracked, too.

        Raises:
            TrackerError: all such poses are keyframes, or there are none.
        """
        session_state = self._session_state
        with self._activities.editing():
            found = session_state.saver.frames_of_earlier_calibration()
            every, people = sorted(set().union(*found.values())), set(found)
            keyframes = session_state.saver.keyframes(range(every[0], every[-1] + 1)) if every else {}
            if all(i in keyframes.get(k, {}) for i, frames in found.items() for k in frames):
                raise TrackerError(
                    "expected tracked poses of an earlier calibration, found none; keyframes stay as they were set"
                )
            starts = sorted(k for k, own in keyframes.items() if people <= own.keys())
            if starts:
                start, within = starts[len(starts) // 2], range(every[0], every[-1] + 1)
                self._tracking.start_outward(start, tuple(sorted(people)), None, lambda _: None, within)
            else:
                session_state.show_frame(frame=every[0])
                self._tracking.start(False, every[-1], from_shown=True)

    def follow(self) -> None:
        """Restore the cameras that belong to the present entry of the history, after a move.

        Raises:
            TrackerError: the calibration cannot be written.
        """
        session_state = self._session_state
        changed = session_state.saver.follow_calibration()
        if changed is not session_state.session:
            self.exchange_cameras(changed, "The calibration followed the history.")

    def exchange_cameras(self, session: Session, message: str) -> None:
        """Draw and score the shown frame with other cameras; a check of the former ones is void."""
        session_state, n = self._session_state, self._session_state.state.calibration.n_changes
        session_state.set_cameras(session)
        self._set(check=None, is_previewed=False, preview=None, message=message, n_changes=n + 1)
        session_state.show_frame()
        session_state.refresh_saving()

    def _found(self) -> CalibrationCheck:
        check = self._session_state.state.calibration.check
        if check is None or not check.named:
            raise TrackerError(
                "expected a camera that a check has found to be off, found none; check the cameras first"
            )
        return check

    def check(self, report: Report) -> tuple[PosedRecording, CalibrationCheck]:
        """Check the cameras by the poses of the session, in bodies that are acquired for it. Nothing is stored.

        Raises:
            TrackerError: fewer than three frames have credible poses.
        """
        recording = with_acquired_bodies(self._recording(), self._session_state.session, report)
        return recording, check_calibration(recording, report=report)

    def _check(self) -> dict[str, Any]:
        report = self._work.report
        recording, check = self.check(report)
        scores = held_out_scores(recording, check, report=report) if check.named else []
        refused = ""
        try:
            check.require_applicable(scores)
        except TrackerError as error:
            refused = page_text(error) if check.named else ""
        return {"check": check, "n_others": len(scores), "n_better": n_better(scores), "refused": refused}

    def _recording(self) -> PosedRecording:
        return PosedRecording.of_session(
            self._session_state.session, self._session_state.frames.observer.at_nearest_times()
        )

    def _follow_state(self, state: State) -> None:
        found = state.calibration
        if found.is_previewed and self._tried != (id(found.check), state.frame):
            self._previews.offer(state)
        version = (state.timeline_version, found.n_changes)
        if version != self._version and not state.track.running:
            self._version = version
            self._outdated.offer(state)

    def _refit(self, _: State) -> None:
        """Refit the people of the shown frame to the corrected cameras."""
        state, session = self._session_state.state, self._session_state.session
        found, check = state.calibration, state.calibration.check
        if check is None or not found.is_previewed or self._tried == (id(check), state.frame):
            return
        self._tried = id(check), state.frame
        recording = self._recording()
        if state.frame not in recording.credible_frames([state.frame]):
            self._set(message="The preview needs poses on this frame and on two before and after it.")
            return
        (seen,), shown = recording.seen([state.frame]), self._session_state.frames.observer
        parameters = [SizeParameters(b.model) for b in seen.bodies]
        sizes, corrections = check.diagnosis.state.sizes, check.corrections_on(state.frame)
        before, after = (score_frame(seen, parameters, sizes, c) for c in (np.zeros_like(corrections), corrections))
        models = [p.body(s) for p, s in zip(parameters, sizes, strict=True)]
        bodies = tuple(
            tuple(
                PosedBody(model, model.retract(values, path.step(later_s(c, seen.time_s) + ahead / session.fps)))
                for model, values, path in zip(models, after.poses, seen.paths, strict=True)
            )
            for ahead, c in zip(shown.ahead_frames(state.frame), corrections, strict=True)
        )
        cameras = tuple(
            corrected(source.camera, c).pinhole for source, c in zip(session.cameras, corrections, strict=True)
        )
        with self._session_state.lock:
            if self._session_state.state.calibration.check is check:
                self._set(preview=CorrectedFrame(state.frame, cameras, bodies, before.cost, after.cost), message="")

    def _find_outdated(self, _: State) -> None:
        session_state = self._session_state
        with session_state.lock:
            saver, before = session_state.saver, session_state.state.calibration
            found, revision = saver.frames_of_earlier_calibration(), saver.calibration_revision
            if (found, revision) != (before.outdated, before.revision):
                self._set(outdated=found, revision=revision)
