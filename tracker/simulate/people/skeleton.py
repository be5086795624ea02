"""The true skeleton of a simulated person: a preset's joints in other proportions."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from tracker.body.model import BodyModel
from tracker.body.parts import Part

Factors = tuple[float, float, float]
"""Factors along x, y, z."""

# Every bone differs from the preset's by 5% or more, some longer and some shorter, so that the body keeps its height. A
# tracker that assumes the preset has a model error like that of a real person.
BONE_FACTORS: Mapping[str, Factors] = MappingProxyType(
    {
        "neck": (1.0, 1.0, 1.055),
        "shoulder": (1.0, 1.08, 1.055),
        "elbow": (1.0, 1.0, 1.07),
        "wrist": (1.0, 1.0, 0.94),
        "hip": (1.0, 0.945, 0.94),
        "knee": (1.0, 1.0, 0.945),
        "ankle": (1.0, 1.0, 1.055),
        "head": (1.0, 1.0, 1.08),
    }
)
"""Factor along x, y, z on the position of each joint or landmark in its parent's frame, left and right alike."""

_END_OF_PART = {"upper_arm": "elbow", "forearm": "wrist", "thigh": "knee", "calf": "ankle"}


def altered_model(model: BodyModel, factors: Mapping[str, Factors] = BONE_FACTORS) -> BodyModel:
    """Return a model with the same degrees of freedom but other bone lengths, by factors as in `BONE_FACTORS`."""
    return replace(
        model,
        name=f"{model.name}_true",
        joints=tuple(replace(j, position=_moved(j.position, j.name, factors)) for j in model.joints),
        parts=tuple(_stretched_part(p, factors) for p in model.parts),
        landmarks=tuple(replace(m, position=_moved(m.position, m.name, factors)) for m in model.landmarks),
    )


def _factors_of(name: str, factors: Mapping[str, Factors]) -> Factors:
    return factors.get(name.removeprefix("left_").removeprefix("right_"), (1.0, 1.0, 1.0))


def _moved(
    position: tuple[float, float, float], name: str, factors: Mapping[str, Factors]
) -> tuple[float, float, float]:
    x, y, z = (p * f for p, f in zip(position, _factors_of(name, factors), strict=True))
    return x, y, z


def _stretched_part(part: Part, factors: Mapping[str, Factors]) -> Part:
    """Stretch a limb's shape with its bone; the shapes of trunk and head stay."""
    end = _END_OF_PART.get(part.name.removeprefix("left_").removeprefix("right_"))
    if end is None:
        return part
    stretch = _factors_of(end, factors)[2]
    (a1, a2, a3), (x, y, z) = part.half_axes, part.center
    return replace(part, half_axes=(a1, a2, a3 * stretch), center=(x, y, z * stretch))
