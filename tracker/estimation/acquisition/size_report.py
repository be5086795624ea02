"""Report acquired sizes: lengths and girths before and after, with their uncertainty."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tracker.body.dimensions import dimensions_of, main_axis, mirror_part, restate_height
from tracker.body.limbs import display_name
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.estimation.acquisition.segment_lengths import segment_lengths
from tracker.estimation.acquisition.size_fit import SizeFit
from tracker.estimation.acquisition.size_parameters import DIFFERENCE, SizeParameters
from tracker.formats.joint_maps import LIMB_JOINTS

SWINGING = ("shoulder", "elbow", "hip", "knee")
"""Joints whose centres are sought by the motion of the limbs below them."""
OBSERVABLE_SWING_RAD = float(np.radians(30.0))
"""Smallest swing that shows the centre of a joint. Functional methods lose it below: S. J. Piazza et al. 2001 (J.
Biomech. 34:967) on the hip with less motion, R. M. Ehrig et al. 2006 (J. Biomech. 39:2798) on any ball joint."""


class SizeChange(NamedTuple):
    """One size of a body before and after an acquisition, metres."""

    name: str
    """For people, such as `left forearm, length`."""
    before_m: float
    after_m: float
    sigma_m: float
    """Standard deviation of the size after the acquisition, metres."""


class JointSwing(NamedTuple):
    """How far a limb turns about a joint."""

    name: str
    """One of `SWINGING`; left and right are one."""
    swing_rad: float
    """Largest angle between two directions of the limb, seen from the part above the joint, of either side, rad."""

    @property
    def is_observable(self) -> bool:
        """Whether the limb turns far enough to show the centre of the joint."""
        return self.swing_rad >= OBSERVABLE_SWING_RAD


class SegmentLength(NamedTuple):
    """The distance of two limb joints of an acquired body in its poses."""

    name: str
    """One of `SEGMENTS`."""
    length_m: float
    """Median over the frames and sides, metres."""
    sigma_m: float
    """Standard deviation by that of the sizes, metres."""


def size_changes(acquisition: Acquisition) -> list[SizeChange]:
    """List all sizes, those that changed most, by share, first. One side stands for both if they are coupled."""
    parameters, fit = acquisition.parameters, acquisition.fit
    before = _measured(parameters, acquisition.before or parameters.base)
    after = _with_sigmas(parameters, fit, lambda body: _measured(parameters, body))
    rows = [SizeChange(n, before[n], *own) for n, own in after.items()]
    return sorted(rows, key=lambda r: -abs(np.log(r.after_m / r.before_m)))


def acquired_segments(acquisition: Acquisition) -> list[SegmentLength]:
    """List the lengths between the limb joints in the poses of the acquisition; none for a body without these joints.

    Trunk and shoulders bend, so that a neutral pose would give other lengths than the footage.
    """
    fit = acquisition.fit
    if not set(LIMB_JOINTS) <= set(fit.body.point_names):
        return []

    def measure(body: BodyModel) -> dict[str, float]:
        places = np.array([PosedBody(body, p).joint_centers_world for p in fit.poses])
        return segment_lengths({n: places[:, i] for i, n in enumerate(body.point_names)})

    return [SegmentLength(n, *own) for n, own in _with_sigmas(acquisition.parameters, fit, measure).items()]


def joint_swings(acquisition: Acquisition) -> list[JointSwing]:
    """List how far the limbs turn about each pair of joints in the poses of the acquisition.

    Contours show the centre of a joint by the motion of a limb about it alone. A turn of the limb about its own axis
    shows it neither.
    """
    model, poses = acquisition.body, acquisition.poses
    Rs = np.array([model.kinematics(p).Ts_world_part[:, :3, :3] for p in poses])
    largest: dict[str, float] = {}
    for i, joint in enumerate(model.joints):
        name = joint.name.removeprefix("left_").removeprefix("right_")
        if name not in SWINGING or not joint.parent:
            continue
        axes = np.einsum("tji,tj->ti", Rs[:, model.part_index[joint.parent]], Rs[:, i, :, main_axis(model, i)])
        swing = float(np.arccos(np.clip(axes @ axes.T, -1, 1)).max())
        largest[name] = max(swing, largest.get(name, 0.0))
    return [JointSwing(n, swing) for n, swing in largest.items()]


def unobservable_joints(acquisition: Acquisition) -> list[str]:
    """Say which joint centres the poses of an acquisition do not show; nothing where joints were given."""
    swings = [] if acquisition.joints_are_given else joint_swings(acquisition)
    return [
        f"the {s.name} turned by {np.degrees(s.swing_rad):.0f} degrees only, which does not show its centre"
        for s in swings
        if not s.is_observable
    ]


def _with_sigmas(
    parameters: SizeParameters, fit: SizeFit, measure: Callable[[BodyModel], dict[str, float]]
) -> dict[str, tuple[float, float]]:
    """Return what is measured of the fitted body, with the standard deviation of each value, by name."""
    found = measure(fit.body)
    J = np.empty((len(found), len(fit.sizes)))
    for i, step in enumerate(DIFFERENCE * np.eye(len(fit.sizes))):
        more = measure(parameters.body(fit.sizes + step))
        J[:, i] = [(more[n] - found[n]) / DIFFERENCE for n in found]
    sigmas = np.sqrt(np.einsum("ij,jk,ik->i", J, fit.covariance, J))
    return {n: (value, float(s)) for (n, value), s in zip(found.items(), sigmas, strict=True)}


def _measured(parameters: SizeParameters, body: BodyModel) -> dict[str, float]:
    """Return each size of a body, metres, by its name for people."""
    sizes = dimensions_of(body)
    out = {"height": restate_height(body, parameters.base).height_m}
    for part, own in sizes.parts.items():
        if parameters.coupled and part.startswith("right_") and mirror_part(part) in sizes.parts:
            continue
        name = display_name(part.removeprefix("left_") if parameters.coupled else part)
        out[f"{name}, length"] = own.length_m
        for side, girth_m in zip(("front to back", "side to side"), own.girths_m, strict=True):
            out[f"{name}, thickness {side}"] = 2 * girth_m
    return out | {f"distance of the {w}s": width_m for w, width_m in sizes.widths_m.items()}
