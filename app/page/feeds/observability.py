"""Updates on how well the views constrain the shown pose, for a page that shows that layer (docs/protocol.md)."""

import numpy as np

from app.control.controller import Controller
from app.messages.server import DofObservability, ObservabilityMessage
from app.state.identity import ObjectIdentity
from app.state.page_view import View
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.estimation.fitting.observability import OBSERVABLE_M, OBSERVABLE_RAD, Observability, observe_pose
from tracker.estimation.fitting.observability_reasons import describe_all
from tracker.evidence.images.working_view import working_scale
from tracker.session.session import Session

LAYER = "observability"
"""Name of the layer."""
_WEAK_SHARE = 0.5
"""Standard deviation, in the largest observable one, above which a degree of freedom is weak."""


class ObservabilityFeed:
    """Remembers what one page has received."""

    def __init__(self) -> None:
        """Begin with nothing sent."""
        self._made_from: tuple[object, ...] = ()

    def is_due(self, state: State, view: View | None) -> bool:
        """Return whether the page lacks the figures of the shown pose; not during a drag or a search."""
        if view is None or LAYER not in view.layers:
            self._made_from = ()
            return False
        busy = state.is_dragging or state.search.running or "contours" not in state.compiled
        return not busy and _ingredients(state) != self._made_from

    def updates(self, controller: Controller, state: State) -> list[ObservabilityMessage]:
        """Return the message that brings the page up to date. It takes some milliseconds: call it in a worker."""
        self._made_from = _ingredients(state)
        return [observability(controller.session, state)]


def observability(session: Session, state: State) -> ObservabilityMessage:
    """Describe how well the views constrain the pose of the selected person."""
    person = state.person
    bodies = [PosedBody(m, p.values) for m, p in zip(state.models, state.people, strict=True)]
    cameras = [c.camera.pinhole.scaled(working_scale(c.camera)) for c in session.cameras]
    found = observe_pose(bodies, cameras, person)
    sentences = describe_all(bodies, cameras, found, person)
    dofs = (_dof(found, d, sentence) for d, sentence in enumerate(sentences))
    return ObservabilityMessage(state.frame, person, tuple(dofs))


def _dof(found: Observability, dof: int, sentence: str) -> DofObservability:
    is_length, sigma = bool(found.model.dof_is_length[dof]), float(found.sigmas[dof])
    limit = OBSERVABLE_M if is_length else OBSERVABLE_RAD
    weak = sigma > _WEAK_SHARE * limit
    return DofObservability(
        "unknown" if not found.is_observable[dof] else "weak" if weak else "known",
        100 * sigma if is_length else float(np.degrees(sigma)),
        sentence,
    )


def _ingredients(state: State) -> tuple[object, ...]:
    """Return what the message is made from, for comparison. Poses are compared by identity."""
    shown = tuple(ObjectIdentity(p.values) for p in state.people)
    return (state.frame, state.person, shown, state.revisions, state.calibration.n_changes)
