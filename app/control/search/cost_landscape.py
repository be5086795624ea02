"""Sample the cost over the range of one degree of freedom, with all others fixed."""

from collections.abc import Sequence

import numpy as np

from app.control.session.session_state import SessionState
from app.control.session.watching_pages import WatchingPages
from app.runtime.jobs import LatestWinsWorker
from app.state.search import CostLandscape
from app.state.state import State
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings, pose_cost
from tracker.estimation.posing.edits import current_value, is_plain, joint_of, poses_along
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

SAMPLES = 121
_REACH_M, _REACH_RAD = 0.5, float(np.pi)
"""Sampled range to either side for a degree of freedom without limits, metres and rad."""
_REST_S = 0.08
"""Minimum time between two landscapes; the pose may change faster."""


class CostLandscapes:
    """Computes the landscape of the newest pose in the background while a page displays it."""

    def __init__(self, session_state: SessionState) -> None:
        """Subscribe to the state; nothing is computed until a page displays the landscape."""
        self._session_state = session_state
        self._pages = WatchingPages[None](session_state, self._changed)
        self._chosen: tuple[int, str | None, str] | None = None  # selected person and point, name of the dof
        self._computed: tuple[object, ...] = ()
        self._latest = LatestWinsWorker(self._compute, "landscape", _REST_S)

    def watch(self, page: int, looks: bool) -> None:
        """Note whether a page displays the landscape.

        Args:
            page: number of the page.
            looks: whether it displays it. The landscape then begins with the selected point.
        """
        if not looks:
            self._pages.leave(page)
        else:
            self._chosen = self._chosen if page in self._pages else None
            self._pages.enter(page, None)
            self._latest.offer(self._session_state.state)

    def choose(self, dof: str) -> None:
        """Choose a degree of freedom of the selected person, by its name, until another point is selected.

        Raises:
            TrackerError: the body has no degree of freedom of that name.
        """
        state = self._session_state.state
        model = state.models[state.person]
        if dof not in model.dof_names:
            raise TrackerError(
                f"expected a degree of freedom such as {model.dof_names[0]}, found '{dof}'; choose one from the list"
            )
        self._chosen = state.person, state.point, dof
        self._latest.offer(self._session_state.state)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _changed(self, state: State) -> None:
        if not state.search.running:
            self._latest.offer(state)

    def _compute(self, state: State) -> None:
        views = self._session_state.frames.cached_evidence(state.frame)
        person, poses = state.person, state.poses
        dof = self._dof_of(state.models[person], state)
        key = (state.frame, person, dof, state.settings, *map(id, poses))
        if views is None or not self._pages or key == self._computed:
            return
        found = landscape(views, state.models, poses, state.settings, person, dof, state.velocities)
        self._computed = key
        self._session_state.set(landscape=found)

    def _dof_of(self, model: BodyModel, state: State) -> int:
        """Return the degree of freedom chosen for the selected point, else one of its joint, else one of a limb."""
        if self._chosen is not None and self._chosen[:2] == (state.person, state.point):
            return model.dof_names.index(self._chosen[2])
        of_point = (
            [] if state.point is None else np.flatnonzero(model.dof_joint == joint_of(model, state.point)).tolist()
        )
        limbs = [d for d in range(model.n_dofs) if model.dof_joint[d] > 0]
        return (of_point or limbs or [0])[0]


def landscape(
    views: Sequence[ViewEvidence],
    models: Sequence[BodyModel],
    poses: Sequence[Array],
    settings: TrackSettings,
    person: int,
    dof: int,
    velocities: Sequence[Array | None] = (),
) -> CostLandscape:
    """Score a person at many values of one degree of freedom within its limits, with all others fixed.

    Args:
        views: evidence of the frame.
        models: the body of each person.
        poses: pose of each person, (n_values,) each.
        settings: outlier distance and treatment of outliers.
        person: index of the person.
        dof: index of the degree of freedom.
        velocities: of each person, if known, see `pose_cost`.
    """
    model = models[person]
    current = current_value(model, poses[person], dof)
    reach = _REACH_M if model.dof_is_length[dof] else _REACH_RAD
    low, high = model.limits[dof] if is_plain(model, dof) else (-np.inf, np.inf)
    low, high = (low if np.isfinite(low) else current - reach), (high if np.isfinite(high) else current + reach)
    values = np.linspace(min(low, current), max(high, current), SAMPLES)
    cost = pose_cost(views, models, poses, settings, velocities)
    totals_px, view_costs_px = cost.of_person(person, poses_along(model, poses[person], [dof], values[:, None]), poses)
    return CostLandscape(person, dof, current, cost(poses).total_px, values, totals_px, view_costs_px)
