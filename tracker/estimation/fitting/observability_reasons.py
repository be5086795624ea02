"""Say in a sentence how well each degree of freedom is known, and why one is not."""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import BENT_RAD, display_name
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.observability import ContourNoise, Observability, observe_pose
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

_BEND_RAD = float(np.radians(60.0))
"""Bend of a straight joint that is tried: by then the part beyond it swings clearly."""
_HIDDEN_PX = 1.0
"""Largest visible length of contour of parts that no view shows, working px."""


def describe_all(
    bodies: Sequence[PosedBody],
    cameras: Sequence[Camera],
    found: Observability,
    person: int = 0,
    noise: ContourNoise | None = None,
) -> tuple[str, ...]:
    """Describe how well each degree of freedom is known.

    Args:
        bodies: all people in their poses.
        cameras: the views, in working pixels.
        found: what `observe_pose` found for this person.
        person: index of the person.
        noise: of the contours.

    Returns:
        A sentence for each degree of freedom, such as "twist of the left shoulder: not observable while the left elbow
        is straight".
    """
    bent = _Bent(bodies, cameras, person, noise)
    return tuple(f"{_name(found.model, d)}: {_verdict(found, d, bent)}" for d in range(found.model.n_dofs))


def _name(model: BodyModel, dof: int) -> str:
    joint, axis = model.dof_names[dof].rsplit(".", 1)
    if model.dof_is_length[dof]:
        return f"{axis} of the {display_name(joint)}"
    return f"{display_name(axis)} of the {display_name(joint)}"


def _verdict(found: Observability, dof: int, bent: "_Bent") -> str:
    model, view = found.model, found.information.cameras[int(found.best_views[dof])]
    if found.is_observable[dof]:
        return f"known to {_amount(model, dof, float(found.sigmas[dof]))}, most of all by view {view}"
    moved = model.moves[dof]
    if found.information.lengths_px[:, moved].sum() < _HIDDEN_PX:
        names = ", ".join(display_name(p.name) for p, at in zip(model.parts, moved, strict=True) if at)
        return f"not observable, because no view shows {names}"
    limit = 0.5 * float(found.sigmas[dof])
    if found.sigmas_alone[dof] > limit:
        straight = bent.straight_joint(found, dof)
        if straight:
            return f"not observable while the {display_name(straight)} is straight"
        return "not observable, because the outlines hardly change with it"
    other = _twin(found, dof)
    if other is None:
        return f"not observable, known to {_amount(model, dof, float(found.sigmas[dof]))} only"
    return f"not observable apart from {_name(model, other)}"


def _twin(found: Observability, dof: int) -> int | None:
    """Return the degree of freedom that changes the outlines most alike; None if none does."""
    likeness = np.abs(found.correlations[dof])
    likeness[dof] = 0.0
    return int(likeness.argmax()) if likeness.max() > 0.3 else None


def _amount(model: BodyModel, dof: int, sigma: float) -> str:
    return f"{100 * sigma:.1f} cm" if model.dof_is_length[dof] else f"{np.degrees(sigma):.1f} degrees"


class _Bent:
    """The same pose with a joint bent that is straight."""

    def __init__(
        self, bodies: Sequence[PosedBody], cameras: Sequence[Camera], person: int, noise: ContourNoise | None
    ) -> None:
        self._bodies, self._cameras, self._person, self._noise = bodies, cameras, person, noise
        self._tried: dict[int, Array] = {}

    def straight_joint(self, found: Observability, dof: int) -> str | None:
        """Return the name of the straight joint, beyond a degree of freedom, whose bend would make it observable."""
        model = found.model
        for bend in range(dof + 1, model.n_dofs):
            joint = model.joints[int(model.dof_joint[bend])]
            if (
                joint.kind != "revolute"
                or not model.moves[dof, model.dof_joint[bend]]
                or np.isfinite(model.spreads[bend])
            ):
                continue
            if abs(self._value(model, bend)) > BENT_RAD:
                continue
            if self._sigmas_alone(model, bend)[dof] < 0.5 * float(found.sigmas_alone[dof]):
                return joint.name
        return None

    def _value(self, model: BodyModel, dof: int) -> float:
        return float(self._bodies[self._person].values[model.dof_value[dof]])

    def _sigmas_alone(self, model: BodyModel, bend: int) -> Array:
        """Return the standard deviations with a joint bent, all others known, (n_dofs,)."""
        if bend not in self._tried:
            body = self._bodies[self._person]
            step = np.zeros(model.n_dofs)
            # Towards the wider side of its limits.
            low, high = model.limits[bend]
            step[bend] = _BEND_RAD if high >= -low else -_BEND_RAD
            bodies = list(self._bodies)
            bodies[self._person] = PosedBody(model, model.move(body.values, step))
            self._tried[bend] = observe_pose(bodies, self._cameras, self._person, self._noise).sigmas_alone
        return self._tried[bend]
