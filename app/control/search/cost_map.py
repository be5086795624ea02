"""Sample the cost over two degrees of freedom around the shown pose, with all others fixed."""

from collections.abc import Sequence

import numpy as np

from app.control.session.session_state import SessionState
from app.control.session.watching_pages import WatchingPages
from app.runtime.jobs import LatestWinsWorker
from app.state.identity import ObjectIdentity
from app.state.search import CostMap
from app.state.state import State
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.estimation.by_frame.frame_problem import Bodies
from tracker.estimation.by_frame.pose_score import scorer_without_prediction
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.posing.edits import current_value, poses_along
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

SAMPLES = 31
"""Samples along each degree of freedom, the present value in the middle unless a limit is near."""
_REACH_RAD, _REACH_M = float(np.radians(60)), 0.3
"""Sampled range to either side, within limits: a step is 4 degrees or 2 cm."""
_REST_S = 0.1
"""Minimum time between two maps; the pose may change faster."""


class CostMaps:
    """Computes the map of the newest pose in the background while a page displays one."""

    def __init__(self, session_state: SessionState) -> None:
        """Subscribe to the state; nothing is computed until a page asks."""
        self._session_state = session_state
        self._pages = WatchingPages[tuple[int, tuple[int, int]]](session_state, self._changed)  # person, dofs
        self._computed: tuple[object, ...] = ()
        self._latest = LatestWinsWorker(self._compute, "cost map", _REST_S)

    def watch(self, page: int, person: int, dofs: tuple[int, int]) -> None:
        """Show a page the map over two degrees of freedom of a person; it follows the pose.

        Raises:
            TrackerError: the body has no two such degrees of freedom.
        """
        self._require(person, dofs)
        self._pages.enter(page, (person, dofs))
        self._latest.offer(self._session_state.state)

    def leave(self, page: int) -> None:
        """Note that a page displays no map."""
        self._pages.leave(page)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _require(self, person: int, dofs: tuple[int, int]) -> None:
        models = self._session_state.models
        if (
            not (0 <= person < len(models))
            or dofs[0] == dofs[1]
            or not all(0 <= d < models[person].n_dofs for d in dofs)
        ):
            raise TrackerError(
                "expected two different degrees of freedom of one of the bodies, found others; reload the page"
            )

    def _changed(self, state: State) -> None:
        if not state.is_dragging and not state.search.running:
            self._latest.offer(state)

    def _compute(self, _: State) -> None:
        wanted, state = self._pages.newest, self._session_state.state
        views = self._session_state.frames.cached_evidence(state.frame)
        if wanted is None or views is None or state.compiling is not None:
            return
        person, dofs = wanted
        key = (state.frame, person, dofs, state.settings, state.revisions, *(ObjectIdentity(v) for v in state.poses))
        if key == self._computed or not self._is_valid(state, person, dofs):
            return
        bodies = tuple(map(PosedBody, state.models, state.poses, map(state.velocity, range(len(state.models)))))
        found = cost_map(views, bodies, person, dofs, state.settings)
        self._computed = key
        self._session_state.set(cost_map=found)

    @staticmethod
    def _is_valid(state: State, person: int, dofs: Sequence[int]) -> bool:
        """Return whether the people who are shown have these degrees of freedom: their bodies may have changed."""
        return person < len(state.models) and max(dofs) < state.models[person].n_dofs


def cost_map(
    views: Sequence[ViewEvidence], bodies: Bodies, person: int, dofs: tuple[int, int], settings: TrackSettings
) -> CostMap:
    """Score a person at many values of two degrees of freedom around the present ones.

    Args:
        views: evidence of the frame.
        bodies: all people; the others stay.
        person: index of the person.
        dofs: indices of the two degrees of freedom, the horizontal one first.
        settings: of the tracker.
    """
    model, pose = bodies[person].model, bodies[person].values
    across, up = (_values(model, pose, dof) for dof in dofs)
    scorer = scorer_without_prediction(views, bodies, person, settings)
    present = float(scorer.costs_with_priors(model, pose[None])[0])
    places = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    nats = scorer.costs_with_priors(model, poses_along(model, pose, dofs, places)) - present
    current = tuple(current_value(model, pose, dof) for dof in dofs)
    return CostMap(person, dofs, (current[0], current[1]), across, up, nats.reshape(len(up), len(across)))


def _values(model: BodyModel, pose: Array, dof: int) -> Array:
    """Return the sampled values of a degree of freedom, (`SAMPLES`,), rad or metres."""
    current, reach = current_value(model, pose, dof), _REACH_M if model.dof_is_length[dof] else _REACH_RAD
    low, high = model.limits[dof]
    return np.linspace(max(current - reach, min(low, current)), min(current + reach, max(high, current)), SAMPLES)
