"""Turn the parts that voxels show into joints, and joints into start poses of any body (MTHC01 Sect. 3 and 6)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import SAME_POSE_M
from tracker.estimation.initialization.generators.head_template import Head, find_head, find_upper_head
from tracker.estimation.initialization.generators.limb_regions import LimbRegion, find_limbs
from tracker.estimation.initialization.generators.standing_body import SIDES, typical_person
from tracker.estimation.initialization.generators.torso_template import Torso, find_torso
from tracker.evidence.voxels.geodesic_distance import VoxelGraph
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

_JOINTS = {"arm": ("elbow", "wrist"), "leg": ("knee", "ankle")}
_TRUNK = ("neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")


class FigureParts(NamedTuple):
    """The parts of a figure."""

    figure: Voxels
    head: Head
    torso: Torso
    """Its narrow axis points forwards and its wide one to the left, or it is turned round: voxels do not tell."""
    limbs: dict[str, LimbRegion]
    """Limbs that stand out, by name: `left_arm` and so on."""

    @property
    def unresolved(self) -> tuple[str, ...]:
        """Names of the limbs that do not stand out, as `left_arm`; a leg or an arm whose side is open without it."""
        return tuple(f"{s}_{k}" for k in _JOINTS for s in SIDES if f"{s}_{k}" not in self.limbs)


def possible_heads(figure: Voxels, graph: VoxelGraph, up: Array) -> list[Head]:
    """Return the heads that a figure may have, the most likely first: at most two.

    Args:
        figure: voxels of one person.
        graph: their `neighbor_graph`.
        up: vertical axis of the world, (3,).

    Raises:
        TrackerError: no head is found.
    """
    heads = [head for head in (find_head(figure, graph), find_upper_head(figure, graph, up)) if head is not None]
    if not heads:
        raise TrackerError(
            "expected a head that stands out of the silhouettes, found none",
            Remedy("another_frame", condition="no arm or other person is beside the head"),
        )
    is_same = np.linalg.norm(heads[0].center - heads[-1].center) < SAME_POSE_M
    return heads[:1] if is_same else heads


def locate_parts(figure: Voxels, graph: VoxelGraph, head: Head) -> FigureParts:
    """Locate neck, torso and limbs of a figure.

    Args:
        figure: voxels of one person.
        graph: their `neighbor_graph`.
        head: the head.

    Raises:
        TrackerError: nothing is below the head.
    """
    # Lengths below are those of an adult: a child is enlarged to one.
    grown = figure.scaled(1 / head.scale)
    torso = find_torso(grown, head.neck / head.scale, head.joint_below_m / head.scale, head.is_head)
    limbs = find_limbs(grown, graph, torso, head.is_head)
    own = {n: limb.scaled(head.scale) for n, limb in _by_side(torso, limbs, len(figure.indices)).items()}
    return FigureParts(figure, head, torso.scaled(head.scale), own)


def turned_round(parts: FigureParts) -> FigureParts:
    """Return the same parts of a person who faces the other way: left and right are exchanged."""
    other = {"left": "right", "right": "left"}
    limbs = {f"{other[n.split('_')[0]]}_{limb.kind}": limb for n, limb in parts.limbs.items()}
    return parts._replace(torso=parts.torso.turned_round(), limbs=limbs)


def start_pose(model: BodyModel, parts: FigureParts) -> Array:
    """Return the pose of a body that comes closest to the joints of a figure, (n_values,).

    Shoulders and hips lie in the torso's frame as in the body. Limbs that are not resolved hang.
    """
    known = joint_positions(model, parts)
    own = model.named_points_world(model.neutral())
    place = rigid.transform(parts.torso.axes, parts.torso.neck_joint)
    for name in parts.unresolved:
        side, kind = name.split("_")
        known |= {j: rigid.apply(place, own[j] - own["neck"]) for j in (f"{side}_{x}" for x in _JOINTS[kind])}
    return fit_to_points(model, known, solver=solve_compiled_or_plain).pose


def joint_positions(model: BodyModel, parts: FigureParts) -> dict[str, Array]:
    """Return the joints that the parts of a figure show, by name, (3,) each, metres."""
    own = model.named_points_world(model.neutral())
    place = rigid.transform(parts.torso.axes, parts.torso.neck_joint)
    found = {n: rigid.apply(place, own[n] - own["neck"]) for n in _TRUNK if n in own}
    for name, limb in parts.limbs.items():
        side = name.split("_")[0]
        middle, distal = _JOINTS[limb.kind]
        found[f"{side}_{middle}"], found[f"{side}_{distal}"] = limb.middle, limb.distal
    return {n: p for n, p in found.items() if n in own}


def _by_side(torso: Torso, limbs: Sequence[LimbRegion], n_voxels: int) -> dict[str, LimbRegion]:
    """Name limbs by the side of the torso that they leave, and two of a kind by their order."""
    found: dict[str, LimbRegion] = {}
    for kind in _JOINTS:
        own = sorted((limb for limb in limbs if limb.kind == kind), key=lambda limb: -len(limb.indices))[:2]
        own.sort(key=lambda limb: -float(torso.local(limb.middle[None])[0, 1]))
        if len(own) == 2:
            found |= {f"left_{kind}": own[0], f"right_{kind}": own[1]}
        elif own and (kind == "arm" or len(own[0].indices) < 3 / 2 * typical_person().share_of("leg") * n_voxels):
            side = "left" if torso.local(own[0].proximal[None])[0, 1] > 0 else "right"
            found[f"{side}_{kind}"] = own[0]
        # A single thick region at the lower end holds both legs: neither is resolved.
    return found
