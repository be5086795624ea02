"""Show the steps of a tracking run: its progress, the frames that it tracks, and their poses by all frames."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from app.control.session.session_state import SessionState
from app.state.people import ShownPose
from app.state.progress import TrackStage, TrackState
from app.state.state import Costs, finite_or_none
from tracker.estimation.tracking import confidence
from tracker.estimation.tracking.tracker import BackwardStep, PoseEstimate
from tracker.pipeline.track_session import EstimatedRows, EstimateStep, Step, TrackSession


class RunDisplay:
    """Shows one run. The caller holds the session's lock."""

    def __init__(self, session_state: SessionState, session: TrackSession, is_running: Callable[[], bool]) -> None:
        """Show nothing yet.

        Args:
            session_state: holds the state.
            session: the run.
            is_running: whether the run goes on after the present step.
        """
        self._session_state, self._session, self._is_running = session_state, session, is_running

    def show(self, step: Step, seconds: float) -> None:
        """Show a step that the run has taken.

        Args:
            step: of any stage.
            seconds: time that the run has worked so far.
        """
        if isinstance(step, EstimatedRows):
            self._show_finished()
        elif isinstance(step, BackwardStep | EstimateStep):
            stage: TrackStage = "back" if isinstance(step, BackwardStep) else "solve"
            track = replace(self._session_state.state.track, stage=stage, done=step.done, total=step.total)
            self._session_state.set(track=replace(track, running=self._is_running()))
        elif isinstance(step, PoseEstimate):
            self._show_tracked(step, seconds)

    def summary(self) -> str:
        """Return a summary of the run, for people to read."""
        track, n_frames = self._session_state.state.track, len(self._session.tracked)
        odd = [f"{n} {what}" for n, what in ((track.doubtful, "doubtful"), (track.lost, "lost")) if n]
        return ", ".join([f"{n_frames} frame{'' if n_frames == 1 else 's'}", *odd])

    def _show_finished(self) -> None:
        """Show the estimated pose of the shown frame, and how many frames are doubtful or lost in the end."""
        session_state = self._session_state
        session_state.note_stored()
        session_state.refresh_saving()
        state = session_state.state
        session_state.show_frame(follow=state.follow, track=self._with_doubts(state.track))

    def _show_tracked(self, found: PoseEstimate, seconds: float) -> None:
        """Show the progress of the first pass, and the frame if it is shown or followed."""
        session_state = self._session_state
        worst = confidence.worst([found.statuses[i] for i in self._session.subjects.tracked])
        track = session_state.state.track
        done, (first, last) = track.done + 1, self._session.ends(found.frame)
        track = replace(
            track, running=self._is_running(), at=found.frame, done=done, per_second=done / max(1e-6, seconds),
            first=first, last=last,
            doubtful=track.doubtful + (worst == "doubtful"), lost=track.lost + (worst == "lost"),
        )  # fmt: skip
        if session_state.state.follow or session_state.state.frame == found.frame:
            session_state.set(track=track, **self._tracked_frame(found))
        else:
            session_state.set(track=track)

    def _tracked_frame(self, found: PoseEstimate) -> dict[str, Any]:
        """Return the fields of the state that show a tracked frame."""
        session_state, subjects = self._session_state, self._session.subjects
        keyframes, tracked = subjects.keyframes_at(found.frame), subjects.tracked
        people = []
        for i, shown in enumerate(session_state.state.people):
            stored = session_state.saver.pose(i, found.frame) if i in keyframes or i not in tracked else None
            if stored is not None:
                people.append(stored)
            elif i not in tracked:
                people.append(ShownPose(shown.values, None, revision=session_state.state.revisions[i]))
            else:
                part_costs_px = tuple(finite_or_none(c) for c in found.part_costs_px[i])
                trace = found.traces[i] if found.traces else None
                shown = ShownPose(found.poses[i], "tracked", found.statuses[i], found.notes[i], part_costs_px)
                people.append(replace(shown, trace=trace))
        models, revisions = session_state.frame_poses.bodies(people)
        view_costs_px = tuple(map(finite_or_none, found.view_costs_px))
        costs = Costs(cost_px=finite_or_none(found.cost_px), view_costs_px=view_costs_px)
        return {"frame": found.frame, "people": tuple(people), "models": models, "revisions": revisions, **vars(costs)}

    def _with_doubts(self, track: TrackState) -> TrackState:
        """Return the progress with the numbers of frames that are doubtful and lost by now."""
        tracked, people = self._session.tracked.values(), self._session.subjects.tracked
        worst = Counter(confidence.worst([frame.statuses[i] for i in people]) for frame in tracked)
        return replace(track, doubtful=worst["doubtful"], lost=worst["lost"])
