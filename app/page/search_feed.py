"""What a page that watches searches is sent: only what it does not know yet (docs/protocol.md)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.control.controller import Controller
from app.control.search import search_settings
from app.control.search.search_runs import SearchRun
from app.page.messages import binary
from app.state.search import CostLandscape, ReplayState
from app.state.state import State, finite_or_none
from tracker.session.session import Session

_COLUMNS = 4
"""Figures of a step: evaluations, cost of the candidate, least cost, index of the stage."""


class SearchFeed:
    """Remembers what one page has been told of searches and landscapes."""

    def __init__(self, tab: str | None = None) -> None:
        """Tell all that a tab of the page's drawer shows from now on.

        Args:
            tab: `search`, `landscape`, or None for neither.

        Raises:
            ValueError: there is no such tab.
        """
        if tab not in ("search", "landscape", None):
            raise ValueError(f"'{tab}' is no tab that searches are shown in")
        self._tab = tab
        self._setup: dict[str, Any] | None = None
        self._runs: dict[str, Any] | None = None
        self._steps: dict[int, tuple[int, int]] = {}  # by run: steps sent, times thinned
        self._candidates: dict[int, tuple[object, ...]] = {}
        self._landscape: CostLandscape | None = None

    def news(self, controller: Controller, with_figures: bool = True) -> list[dict[str, Any] | bytes]:
        """Messages that bring the page up to date, the text ones as objects.

        Args:
            controller: of the session.
            with_figures: whether to tell of runs and their candidates too, not only of their steps.
        """
        if self._tab == "landscape":
            shown = controller.state.landscape
            if shown is None or shown is self._landscape:
                return []
            self._landscape = shown
            return [landscape(controller.session, shown)]
        if self._tab != "search":
            return []
        out: list[dict[str, Any] | bytes] = []
        with controller.lock:
            found, state = controller.replay.runs(), controller.state  # of the same moment
            told = runs(found, state) if with_figures or self._runs is None else self._runs
            if told != self._runs:
                self._runs = told
                out.append(told)
            now = setup(controller, state)
            if now != self._setup:
                self._setup = now
                out.append(now)
            known = {run["number"] for run in told["runs"]}
            for run in (run for run in found if run.number in known):
                out += self._steps_of(run)
                if with_figures:
                    out += self._candidates_of(controller.session, run)
            kept = {run.number for run in found}
            self._steps = {n: sent for n, sent in self._steps.items() if n in kept}
            self._candidates = {n: sent for n, sent in self._candidates.items() if n in kept}
        return out

    def _steps_of(self, run: SearchRun) -> list[bytes]:
        first, thinned = self._steps.get(run.number, (0, run.thinned))
        first = 0 if thinned != run.thinned else first
        if (run.number in self._steps and first == len(run.steps)) and thinned == run.thinned:
            return []
        self._steps[run.number] = (len(run.steps), run.thinned)
        return [steps(run, first)]

    def _candidates_of(self, session: Session, run: SearchRun) -> list[bytes]:
        key = tuple(id(c) for c in run.candidates)
        if key == self._candidates.get(run.number, ()):
            return []
        self._candidates[run.number] = key
        return [candidates(session, run)]


def setup(controller: Controller, state: State) -> dict[str, Any]:
    """The decomposition, and all settings of the search that the page edits."""
    settings, search = state.settings, state.settings.search
    return {
        "type": "search_setup",
        "theta_px": settings.theta_px,
        "outliers": settings.outliers,
        "passes": list(search.passes),
        "patience": search.patience,
        "max_expansions": search.max_expansions,
        "limbs_apart": search.limbs_apart,
        "bound_rad": search.bound_rad,
        "bound_m": search.bound_m,
        "step_rad": search.step_rad,
        "step_m": search.step_m,
        "speed": state.search_view.speed,
        "leaves": [
            {**vars(leaf), "dofs": list(leaf.dofs)}
            for leaf in search_settings.leaves(controller.models, search, controller.active_dofs())
        ],
    }


def runs(found: Sequence[SearchRun], state: State) -> dict[str, Any]:
    """The runs of the shown frame with their stages, and what is looked at of them."""
    differing = search_settings.differences([r.settings for r in found])
    return {
        "type": "search_runs",
        "runs": [_run(run, differs, state) for run, differs in zip(found, differing, strict=True)],
        "replay": _replay(state.search_view.replay),
        "compared": state.search_view.compared_run,
    }


def steps(run: SearchRun, first: int) -> bytes:
    """The figures of a run's recorded steps from one on."""
    rows = [(s.evaluations, s.candidate_px, s.best_px, s.stage) for s in run.steps[first:]]
    header = {"type": "search_steps", "run": run.number, "first": first, "count": len(rows)}
    return binary(header, np.array(rows, dtype="<f4").reshape(-1, _COLUMNS).T.tobytes())


def candidates(session: Session, run: SearchRun) -> bytes:
    """The best poses of a run as points in every view; NaN behind a camera."""
    n, cameras = len(run.candidates), [c.camera.pinhole for c in session.cameras]
    people = [len(p.model.point_names) for p in session.people]
    points = np.full((n, len(cameras), sum(people), 2), np.nan)
    for i, candidate in enumerate(run.candidates):
        for c, camera in enumerate(cameras):
            points[i, c] = camera.project(candidate.points_world)
    header = {
        "type": "search_candidates",
        "run": run.number,
        "costs_px": [finite_or_none(c.px) for c in run.candidates],
        "points": people,
        "clearest_view": _clearest_view(points),
    }
    return binary(header, points.astype("<f4").tobytes())


def landscape(session: Session, found: CostLandscape) -> bytes:
    """A landscape: its values, the total costs, then the costs of each view."""
    model = session.people[found.person].model
    header = {
        "type": "landscape",
        "person": found.person,
        "dof": found.dof,
        "names": list(model.dof_names),
        "unit": "m" if model.dof_is_length[found.dof] else "rad",
        "current": found.current,
        "current_px": finite_or_none(found.current_px),
        "count": len(found.values),
    }
    return binary(header, np.vstack([found.values, found.totals_px, found.views_px.T]).astype("<f4").tobytes())


def _run(run: SearchRun, differs: dict[str, str], state: State) -> dict[str, Any]:
    is_current = state.search.kind is not None and not run.over
    at = max((i for i, c in enumerate(run.counts) if c.expansions), default=-1)
    return {
        "number": run.number,
        "state": "over" if not is_current else "running" if state.search.running else "paused",
        "start_px": finite_or_none(run.start_px),
        "best_px": finite_or_none(run.best_px),
        "evaluations": run.evaluations,
        "seconds": run.seconds,
        "steps": len(run.steps),
        "thinned": run.thinned,
        "differs": differs,
        "stages": [
            {
                "person": stage.person,
                "name": stage.group.name,
                "factor": stage.factor,
                "evaluations": count.evaluations,
                "gain_px": count.gain_px,
                "done": count.done,
                "running": is_current and i == at and not count.done,
            }
            for i, (stage, count) in enumerate(zip(run.stages, run.counts, strict=True))
        ],
    }


def _replay(replay: ReplayState | None) -> dict[str, Any] | None:
    if replay is None:
        return None
    return {
        "run": replay.run,
        "step": replay.step,
        "stage": replay.stage,
        "candidate_px": replay.candidate_px,
        "best_px": replay.best_px,
        "evaluations": replay.evaluations,
    }


def _clearest_view(points: np.ndarray) -> int:
    """The view in which candidates, (n, V, N, 2) px, differ most."""
    if len(points) < 2:
        return 0
    spreads = np.nan_to_num(points.std(axis=0)).sum(axis=(1, 2))
    return int(np.argmax(spreads))
