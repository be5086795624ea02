"""Measure a body's dimensions from known joints: segment lengths over a recording, shapes stretched along with them."""

from dataclasses import replace

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.parts import Joint, Landmark, Part
from tracker.errors import TrackerError
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array

_SIDES = ("left", "right")
_SEGMENTS = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
_CREDIBLE = (0.6, 1.6)
"""A measured segment outside this range of the model's length is an error in the joints."""


def fit_sizes(model: BodyModel, joints: MarkerTable) -> BodyModel:
    """Give a body the segment lengths of measured joints; girths stay, and both sides become equal.

    The length of a limb's segment is the median over the frames and both sides. So are the widths of shoulders and
    hips, and the distance between their middles, which sets the length of the trunk. Parts stretch along their segment.

    Args:
        model: the body to start from.
        joints: joints under the project's names, metres.

    Raises:
        TrackerError: the joints lack a segment, or give one an impossible length.
    """
    part_of = {m.name: m.part for m in model.landmarks} | {j.name: j.parent for j in model.joints}
    ends = _rest_points(model)
    stretch: dict[str, float] = {}  # of each limb part, along z
    for start, end in _SEGMENTS:
        measured = _median(
            [_distances(joints, f"{side}_{start}", f"{side}_{end}") for side in _SIDES], f"{start}-{end}"
        )
        own = float(np.linalg.norm(ends[f"left_{end}"] - ends[f"left_{start}"]))
        for side in _SIDES:
            stretch[part_of[f"{side}_{end}"]] = _credible(measured / own, f"{start}-{end}")
    trunk = {
        girdle: _credible(
            _median([_distances(joints, f"left_{girdle}", f"right_{girdle}")], f"{girdle} width")
            / float(np.linalg.norm(ends[f"left_{girdle}"] - ends[f"right_{girdle}"])),
            f"{girdle} width",
        )
        for girdle in ("shoulder", "hip")
    }
    spine = _median([_spine(joints)], "trunk")
    own_spine = float(np.linalg.norm(_middle(ends, "shoulder") - _middle(ends, "hip")))
    stretch[model.parts[0].name] = _credible(spine / own_spine, "trunk")
    return replace(
        model,
        joints=tuple(_moved_joint(j, stretch.get(j.parent, 1.0), trunk) for j in model.joints),
        parts=tuple(_stretched_part(p, stretch.get(p.name, 1.0)) for p in model.parts),
        landmarks=tuple(_moved_landmark(m, stretch.get(m.part, 1.0)) for m in model.landmarks),
    )


def _rest_points(model: BodyModel) -> dict[str, Array]:
    return dict(zip(model.point_names, model.points_world(model.neutral()), strict=True))


def _middle(points: dict[str, Array], girdle: str) -> Array:
    return (points[f"left_{girdle}"] + points[f"right_{girdle}"]) / 2


def _column(joints: MarkerTable, name: str) -> Array:
    if name not in joints.names:
        raise TrackerError(f"fitting sizes needs the joint '{name}', found {', '.join(joints.names)}")
    return joints.points[:, joints.names.index(name)]


def _distances(joints: MarkerTable, a: str, b: str) -> Array:
    return np.linalg.norm(_column(joints, a) - _column(joints, b), axis=1)


def _spine(joints: MarkerTable) -> Array:
    shoulders, hips = ((_column(joints, f"left_{g}") + _column(joints, f"right_{g}")) / 2 for g in ("shoulder", "hip"))
    return np.linalg.norm(shoulders - hips, axis=1)


def _median(lengths: list[Array], what: str) -> float:
    known = np.concatenate(lengths)
    known = known[np.isfinite(known)]
    if not len(known):
        raise TrackerError(f"fitting sizes needs a frame in which both ends of {what} are known, found none")
    return float(np.median(known))


def _credible(ratio: float, what: str) -> float:
    if not _CREDIBLE[0] <= ratio <= _CREDIBLE[1]:
        raise TrackerError(
            f"fitting sizes: {what} came out {ratio:.2f} times as long as the model's; expected {_CREDIBLE[0]} to "
            f"{_CREDIBLE[1]}; check the joints' units and --joint-map, or give the body's --height"
        )
    return ratio


def _moved_joint(joint: Joint, stretch: float, trunk: dict[str, float]) -> Joint:
    x, y, z = joint.position
    width = next((ratio for girdle, ratio in trunk.items() if joint.name.endswith(f"_{girdle}")), 1.0)
    return replace(joint, position=(x, y * width, z * stretch))


def _moved_landmark(landmark: Landmark, stretch: float) -> Landmark:
    x, y, z = landmark.position
    return replace(landmark, position=(x, y, z * stretch))


def _stretched_part(part: Part, stretch: float) -> Part:
    (a1, a2, a3), (x, y, z) = part.half_axes, part.center
    return replace(part, half_axes=(a1, a2, a3 * stretch), center=(x, y, z * stretch))
