"""Updates for a page that watches searches: only what changed since the last ones (docs/protocol.md)."""

from collections.abc import Sequence

import numpy as np

from app.control.controller import Controller
from app.control.search import search_settings
from app.control.search.search_runs import SearchRun
from app.messages import search as wire
from app.messages.base import Message, encode_binary, made_of
from app.messages.binary_headers import LandscapeHeader, SearchCandidatesHeader, SearchStepsHeader
from app.messages.client import Tab
from app.state.identity import ObjectIdentity
from app.state.search import CostLandscape
from app.state.state import State, finite_or_none
from tracker.session.session import Session

_COLUMNS = 4
"""Figures of a step: evaluations, cost of the candidate, least cost, index of the stage."""


class SearchFeed:
    """Remembers which searches and landscapes one page has received."""

    def __init__(self, tab: Tab | None = None) -> None:
        """Begin with nothing sent.

        Args:
            tab: the tab of the drawer that the page shows; None for neither.
        """
        self._tab = tab
        self._setup: wire.SearchSetupMessage | None = None
        self._runs: wire.SearchRunsMessage | None = None
        self._steps: dict[int, tuple[int, int]] = {}  # by run: steps sent, times thinned
        self._candidates: dict[int, tuple[ObjectIdentity, ...]] = {}
        self._landscape: CostLandscape | None = None

    def updates(self, controller: Controller, with_figures: bool = True) -> list[Message | bytes]:
        """Return the messages that bring the page up to date; binary ones are encoded.

        Args:
            controller: of the session.
            with_figures: whether to include runs and their candidates, not only steps.
        """
        if self._tab == "landscape":
            shown = controller.state.landscape
            if shown is None or shown is self._landscape:
                return []
            self._landscape = shown
            return [landscape(controller.session, shown)]
        if self._tab != "search":
            return []
        out: list[Message | bytes] = []
        with controller.lock:  # runs and state of the same moment
            found, state = controller.replay.runs(), controller.state
            listed = runs(found, state) if with_figures or self._runs is None else self._runs
            if listed != self._runs:
                self._runs = listed
                out.append(listed)
            now = setup(controller, state)
            if now != self._setup:
                self._setup = now
                out.append(now)
            sent = {run.number for run in listed.runs}
            for run in (run for run in found if run.number in sent):
                out += self._steps_of(run)
                if with_figures:
                    out += self._candidates_of(controller.session, run)
            stored = {run.number for run in found}
            self._steps = {n: sent for n, sent in self._steps.items() if n in stored}
            self._candidates = {n: sent for n, sent in self._candidates.items() if n in stored}
        return out

    def _steps_of(self, run: SearchRun) -> list[bytes]:
        first, thinned = self._steps.get(run.number, (0, run.thinned))
        first = 0 if thinned != run.thinned else first
        if (run.number in self._steps and first == len(run.steps)) and thinned == run.thinned:
            return []
        self._steps[run.number] = (len(run.steps), run.thinned)
        return [steps(run, first)]

    def _candidates_of(self, session: Session, run: SearchRun) -> list[bytes]:
        key = tuple(map(ObjectIdentity, run.candidates))
        if key == self._candidates.get(run.number, ()):
            return []
        self._candidates[run.number] = key
        return [candidates(session, run)]


def setup(controller: Controller, state: State) -> wire.SearchSetupMessage:
    """Describe the decomposition of the search."""
    leaves = search_settings.leaves(controller.models, state.settings.search, controller.active_dofs())
    return wire.SearchSetupMessage(speed=state.search_view.speed, leaves=tuple(leaves))


def runs(found: Sequence[SearchRun], state: State) -> wire.SearchRunsMessage:
    """Describe the runs of the shown frame with their stages, and the step that is replayed."""
    differing = search_settings.differences([r.settings for r in found])
    listed = tuple(_run(run, differs, state) for run, differs in zip(found, differing, strict=True))
    replay = state.search_view.replay
    shown = None if replay is None else made_of(wire.Replay, replay, best_px=replay.cost_px)
    return wire.SearchRunsMessage(listed, shown, state.search_view.compared_run)


def steps(run: SearchRun, first: int) -> bytes:
    """Encode the figures of a run's recorded steps from one on."""
    rows = [(s.evaluations, s.candidate_px, s.best_px, s.stage) for s in run.steps[first:]]
    header = SearchStepsHeader(run.number, first, len(rows))
    return encode_binary(header, np.array(rows, dtype="<f4").reshape(-1, _COLUMNS).T.tobytes())


def candidates(session: Session, run: SearchRun) -> bytes:
    """Encode the best poses of a run as points in every view; NaN behind a camera."""
    n, cameras = len(run.candidates), [c.camera.pinhole for c in session.cameras]
    people = tuple(len(p.model.point_names) for p in session.people)
    points = np.full((n, len(cameras), sum(people), 2), np.nan)
    for i, candidate in enumerate(run.candidates):
        for c, camera in enumerate(cameras):
            points[i, c] = camera.project(candidate.points_world)
    costs_px = tuple(finite_or_none(c.px) for c in run.candidates)
    header = SearchCandidatesHeader(run.number, costs_px, people, _clearest_view(points))
    return encode_binary(header, points.astype("<f4").tobytes())


def landscape(session: Session, found: CostLandscape) -> bytes:
    """Encode a landscape: its values, the mean costs, then the costs of each view."""
    model = session.people[found.person].model
    header = made_of(
        LandscapeHeader,
        found,
        names=model.dof_names,
        unit="m" if model.dof_is_length[found.dof] else "rad",
        current_px=finite_or_none(found.current_px),
        count=len(found.values),
    )
    return encode_binary(
        header, np.vstack([found.values, found.totals_px, found.view_costs_px.T]).astype("<f4").tobytes()
    )


def _run(run: SearchRun, differs: dict[str, str], state: State) -> wire.SearchRun:
    is_current = state.search.kind is not None and not run.over
    at = max((i for i, c in enumerate(run.counts) if c.expansions), default=-1)
    stages = tuple(
        made_of(
            wire.SearchStage,
            count,
            person=stage.person,
            name=stage.group.name,
            factor=stage.factor,
            running=is_current and i == at and not count.done,
        )
        for i, (stage, count) in enumerate(zip(run.stages, run.counts, strict=True))
    )
    return made_of(
        wire.SearchRun,
        run,
        state="over" if not is_current else "running" if state.search.running else "paused",
        start_px=finite_or_none(run.start_px),
        best_px=finite_or_none(run.end_px),
        steps=len(run.steps),
        differs=differs,
        stages=stages,
    )


def _clearest_view(points: np.ndarray) -> int:
    """Return the view in which candidates, (n, V, N, 2) px, differ most."""
    if len(points) < 2:
        return 0
    return int(np.argmax(np.nan_to_num(points.std(axis=0)).sum(axis=(1, 2))))
