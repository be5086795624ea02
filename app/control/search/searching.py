"""Search the poses of the shown frame, step by step or to the end, and save the best ones."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from app.control.search.search_runs import SearchRun, SearchRuns
from app.control.session.activities import Activities
from app.control.session.comparing import note_comparison
from app.control.session.session_state import SessionState
from app.remedies import page_text
from app.runtime.jobs import Job
from app.state.people import ShownPose
from app.state.search import SearchState, SearchView
from app.state.state import Costs
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings, search_frame
from tracker.estimation.contour.fit_steps import FitPlan, contour_steps
from tracker.estimation.search.best_first import SearchStep, Stage, stages
from tracker.estimation.tracking.tracker import Subjects
from tracker.geometry.arrays import Array

_ContourFit = Literal["body", "chains"]
_SAVE_S = 0.5
"""A running search is saved at least this often."""


class SearchRunner:
    """The search on the shown frame, running or paused; at most one."""

    def __init__(self, session_state: SessionState, runs: SearchRuns, activities: Activities) -> None:
        """Search nothing yet.

        Args:
            session_state: holds the state.
            runs: records the searches.
            activities: ends tracking and gestures before a search.
        """
        self._session_state, self._runs, self._activities = session_state, runs, activities
        activities.add_job(self, on_shown_frame=True)
        self._job: Job[SearchStep] | None = None
        self._run: SearchRun | None = None
        self._sources: list[tuple[str, ...]] = []  # of the values of each person; '' for those not searched yet
        self._stage: Stage | None = None
        self._person: int | None = None  # the only person searched; None for all people
        self._before: tuple[tuple[ShownPose, ...], Costs] | None = None  # the poses before the search and their costs

    @property
    def running(self) -> bool:
        """Whether a search is running."""
        return self._job is not None and self._job.running

    def set_settings(self, settings: TrackSettings) -> None:
        """Change the settings of the next search or tracking run; a paused search is discarded."""
        self.halt()
        with self._session_state.lock:
            self.forget()
            self._session_state.set(settings=settings)

    def step(self, person: int | None = None) -> None:
        """Do one expansion of the search, and begin a search if none of the same people is paused.

        Args:
            person: index of the only person to search, with all others fixed; by default all people are searched.
        """
        with self._activities.starting(self):
            if not self.running:
                self._session_state.require_editable()
                self._paused_job(person).step()

    def run_stage(self, person: int | None = None) -> None:
        """Search to the end of the current stage, or of the next one if a stage has just ended; see `step`."""
        self._go(lambda step: step.stage_done, person)

    def run(self, person: int | None = None) -> None:
        """Search to the end; continues a paused search of the same people, see `step`."""
        self._go(lambda _: False, person)

    def fit_contours(self, person: int | None = None, by_chains: bool = False) -> None:
        """Fit people to the image contours as KRH08 does, one iteration after the other; see `step`.

        Every iteration is recorded, so that the replay shows it.

        Args:
            person: see `step`.
            by_chains: fit a rough pose chain by chain: the root, the trunk, each limb, then the whole body.
        """
        self.halt()
        with self._activities.starting(self):
            if not self.running:
                self.forget()
                self._go(lambda _: False, person, contours="chains" if by_chains else "body")

    def run_again(self, number: int | None = None, person: int | None = None) -> None:
        """Search again from the start of a recorded run of this frame, with the present settings.

        Args:
            number: of the run; None for the newest.
            person: see `step`.

        Raises:
            TrackerError: the run is no longer recorded.
        """
        self.halt()
        with self._activities.starting(self):
            runs = self._runs.of_frame(self._session_state.state.frame)
            if number is not None:
                runs = [r for r in runs if r.number == number]
                if not runs:
                    raise TrackerError(
                        f"expected a recorded run of this frame, found run {number}, which is discarded; "
                        "choose another from the list"
                    )
            if not self.running:
                self.forget()
                self._go(lambda _: False, person, runs[-1].start if runs else None)

    def set_speed(self, speed: float | None) -> None:
        """Limit the search to a number of expansions per second; None for full speed.

        Raises:
            TrackerError: the speed is not a positive number.
        """
        if speed is not None and not (np.isfinite(speed) and speed > 0):
            raise TrackerError(f"expected a speed above 0 expansions a second, found {speed:g}; choose another")
        with self._session_state.lock:
            self._session_state.set(search_view=replace(self._session_state.state.search_view, speed=speed))
            if self._job is not None:
                self._job.pace(_rest_s(speed))

    def halt(self) -> None:
        """Pause a running search after its current step. The caller must not hold the lock: the step takes it."""
        job = self._job
        if job is not None:
            job.stop()

    def forget(self) -> None:
        """Discard a paused search; late steps are ignored."""
        if self._job is not None:
            self._job.discard()
        self._job = None
        if self._run is not None:
            self._run.over = True
        self._session_state.set(search=SearchState())

    def forget_paused(self) -> None:
        """Discard a paused search, whose poses others have replaced; called under the lock."""
        if self._job is not None and not self.running:
            self.forget()

    def stop(self) -> None:
        """Pause a running search with its best poses on disk; end a paused one. The caller must not hold the lock."""
        was_running = self.running
        self.halt()
        with self._session_state.lock:
            if self._job is not None and not (was_running or self.running or self._job.ended):
                self._end()

    def _go(
        self,
        until: Callable[[SearchStep], bool],
        person: int | None,
        start: tuple[Array, ...] | None = None,
        contours: _ContourFit | None = None,
    ) -> None:
        with self._activities.starting(self):
            if not self.running:
                self._session_state.require_editable()
                job = self._paused_job(person, start, contours)
                self._session_state.set(search=replace(self._session_state.state.search, running=True))
                job.run(until)

    def _paused_job(
        self, person: int | None, start: tuple[Array, ...] | None = None, contours: _ContourFit | None = None
    ) -> Job[SearchStep]:
        """Return the paused search of the same people, or a new one from given poses, by default the shown ones."""
        session_state, state = self._session_state, self._session_state.state
        if self._job is None or self._job.ended or self._person != person:
            frame, settings, models = state.frame, state.settings, session_state.models
            poses = state.poses if start is None else session_state.within_locks(start)
            free = [session_state.active_dofs(i) & (person is None or i == person) for i in range(len(models))]
            if not stages(models, settings.search, active_dofs=free):
                raise TrackerError("expected degrees of freedom to search, found all of them locked; unlock some")
            if self._run is not None:
                self._run.over = True
            if self._job is not None:
                self._job.discard()
            costs = session_state.costs(poses)
            people = tuple(
                p if p.values is v else ShownPose(v, p.source) for p, v in zip(state.people, poses, strict=True)
            )
            plan = None if contours is None else FitPlan(models, free, contours == "chains")
            known_px = np.nan if plan is not None or costs.cost_px is None else costs.cost_px
            planned = None if plan is None else plan.stages
            run = self._runs.add(SearchRun(frame, models, poses, known_px, settings, free, planned))
            subjects = Subjects.of(models, active_dofs=free)

            def steps() -> Iterator[SearchStep]:
                views = session_state.frames.evidence(frame)
                if plan is not None:
                    return contour_steps(views, poses, plan)
                return search_frame(views, subjects, poses, settings, state.velocities)

            job: Job[SearchStep] = Job(
                steps,
                lambda step, seconds: self._stepped(job, step, seconds),
                lambda error: self._ended(job, error),
                lambda: self._paused(job),
            )
            job.pace(_rest_s(state.search_view.speed))
            self._job, self._run, self._person, session_state.open_edit_owner = job, run, person, None
            self._sources = [("",) * len(p) for p in poses]
            self._stage = None
            self._before = people, costs
            session_state.set(search=SearchState(kind="search"))
        return self._job

    def _stepped(self, job: Job[SearchStep], step: SearchStep, seconds: float) -> None:
        session_state = self._session_state
        with session_state.lock:
            if job is not self._job or self._run is None:
                return
            self._run.add(step, seconds)
            if step.stage is not self._stage:
                self._note_stage(step.stage)
            people = tuple(
                p if self._is_fixed(i) or (p.source is not None and np.array_equal(p.values, best))
                else ShownPose(best, self._source_of(p, job), sources=self._sources[i])
                for i, (p, best) in enumerate(zip(session_state.state.people, step.best, strict=True))
            )  # fmt: skip
            costs = session_state.costs(tuple(p.values for p in people))
            shown = replace(
                session_state.state.search, running=job.running, kind="search", stage=step.stage.name,
                evaluations=step.evaluations,
                best_px=costs.cost_px, candidate=step.candidate, message="",
            )  # fmt: skip
            changed = any(a is not b for a, b in zip(people, session_state.state.people, strict=True))
            session_state.set(people=people, search=shown, search_view=self._compared_with(self._run), **vars(costs))
            if changed and time.monotonic() - session_state.last_save > _SAVE_S:
                session_state.save("search", "searched", job)

    def _paused(self, job: Job[SearchStep]) -> None:
        with self._session_state.lock:
            if job is self._job and self._run is not None:
                self._session_state.set(search=replace(self._session_state.state.search, running=False))
                self._run.rest(self._session_state.state.cost_px)
                self._compare()
                self._save(job)

    def _ended(self, job: Job[SearchStep], error: Exception | None) -> None:
        session_state = self._session_state
        with session_state.lock:
            if job is not self._job or self._run is None:
                return
            self._run.over = True
            if error is None:
                message = f"done: {session_state.state.search.evaluations} poses scored"
            else:
                message = page_text(error) if isinstance(error, TrackerError) else f"the search failed: {error}"
            ended = replace(
                session_state.state.search, running=False, kind=None, stage=None, candidate=None, message=message,
                failed=error is not None,
            )  # fmt: skip
            session_state.set(search=ended)
            self._run.rest(session_state.state.cost_px)
            if error is None:
                self._compare()
            self._save(job)

    def _end(self) -> None:
        """Discard a paused search at the user's request; its best poses stay."""
        session_state = self._session_state
        message = f"stopped: {session_state.state.search.evaluations} poses scored"
        self.forget()
        session_state.set(search=SearchState(message=message))

    def _compared_with(self, run: SearchRun) -> SearchView:
        """Return the search view; where a continued run is drawn for comparison, with its new result."""
        view = self._session_state.state.search_view
        return replace(view, compared=run.best) if view.compared_run == run.number else view

    def _compare(self) -> None:
        """Compare the shown poses with those before the search."""
        if self._before is not None:
            before, costs = self._before
            if costs.cost_px is None:  # the evidence came with the first step
                self._before = before, costs = before, self._session_state.costs(tuple(p.values for p in before))
            moved = [person for person in range(len(before)) if not self._is_fixed(person)]
            note_comparison(self._session_state, "search", before, costs, moved)

    def _is_fixed(self, person: int) -> bool:
        """Return whether only another person is searched, so that this person's pose stays as it is."""
        return self._person is not None and person != self._person

    def _note_stage(self, stage: Stage) -> None:
        """Note that a stage searches its values: they have this source even where the search leaves them unchanged."""
        found = self._session_state.free_sources(stage.person, "searched", stage.group.dofs)
        known = self._sources[stage.person]
        self._sources[stage.person] = tuple(new or old for new, old in zip(found, known, strict=True))
        self._stage = stage

    def _source_of(self, shown: ShownPose, job: Job[SearchStep]) -> str:
        """Return the source of a searched pose; once saved it counts the values that are not searched."""
        return shown.source if shown.source and self._session_state.open_edit_owner is job else "searched"

    def _save(self, job: Job[SearchStep]) -> None:
        if not self._session_state.is_shown_stored(self._session_state.state):
            self._session_state.save("search", "searched", job)


def _rest_s(speed: float | None) -> float:
    """Rest after each expansion, seconds; none at full speed."""
    return 0.0 if speed is None else 1.0 / speed
