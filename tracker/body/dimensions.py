"""The sizes of a body as people measure and enter them: lengths and girths of its parts, the width of its hips.

A part has a main axis, along which the joints and landmarks on it lie farthest apart: its length is that distance, and
with it everything on the part is stretched. Across it are two half girths, at the middle of the part's shape.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel
from tracker.body.parts import Joint, Landmark, Part
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array

_LEAST_HEIGHT_M, _MOST_HEIGHT_M = 0.3, 3.0
_LEAST_M, _MOST_SHARE = 0.005, 0.7
"""Shortest size of a part, metres; longest, as a share of the body's height."""
_SIDES = ("left_", "right_")
_WIDTHS = ("shoulder", "hip")
"""Joints, one on each side, whose distance is a size of its own where one part carries both."""


class PartDimensions(NamedTuple):
    """The sizes of one part."""

    length_m: float
    """Between the joints and landmarks on it, or from its joint, metres."""
    girths_m: tuple[float, float]
    """Half its thickness across, front to back and side to side (up and down where it lies across), metres."""


class BodyDimensions(NamedTuple):
    """The sizes of a body."""

    height_m: float
    """By which everything is scaled, metres."""
    parts: Mapping[str, PartDimensions]
    """By name of the part."""
    widths_m: Mapping[str, float]
    """Distance of the two shoulders, or hips, by name (`hip`), where one part carries both, metres."""


def sizes_of(model: BodyModel) -> BodyDimensions:
    """Measure a body."""
    parts = {}
    for index, part in enumerate(model.parts):
        axis = _main_axis(model, index)
        across = [a for a in range(3) if a != axis]
        girths = (part.half_axes[across[0]] * model.height_m, part.half_axes[across[1]] * model.height_m)
        parts[part.name] = PartDimensions(_length(model, index) * model.height_m, girths)
    return BodyDimensions(
        model.height_m, parts, {w: 2 * _half_width(model, w) * model.height_m for w in _girdles(model)}
    )


def with_sizes(model: BodyModel, sizes: BodyDimensions) -> BodyModel:
    """The same body of other sizes.

    Args:
        model: the body.
        sizes: all of them, as `sizes_of` gives them.

    Raises:
        TrackerError: a size is no length that a body can have.
    """
    if not _LEAST_HEIGHT_M <= sizes.height_m <= _MOST_HEIGHT_M:
        raise TrackerError(
            f"expected a height of {_LEAST_HEIGHT_M * 100:g} to {_MOST_HEIGHT_M * 100:g} cm, "
            f"found {sizes.height_m * 100:g}; enter the person's own"
        )
    stretch = np.ones((len(model.parts), 3))  # of each part along its axes
    for index, part in enumerate(model.parts):
        wanted, axis = sizes.parts[part.name], _main_axis(model, index)
        own = _length(model, index)
        across = [a for a in range(3) if a != axis]
        for name, size_m in (("length", wanted.length_m), ("girth", wanted.girths_m[0]), ("girth", wanted.girths_m[1])):
            _check(f"{name} of {display_name(part.name)}", size_m, sizes.height_m)
        stretch[index, axis] = wanted.length_m / sizes.height_m / own
        for a, girth_m in zip(across, wanted.girths_m, strict=True):
            stretch[index, a] = girth_m / sizes.height_m / part.half_axes[a]
    widths = {}
    for name, width_m in sizes.widths_m.items():
        _check(f"distance of the {name}s", width_m, sizes.height_m)
        widths[name] = width_m / sizes.height_m / (2 * _half_width(model, name))
    along = np.ones_like(stretch)  # joints and landmarks follow the length of their part, not its girth
    for index in range(len(model.parts)):
        along[index, _main_axis(model, index)] = stretch[index, _main_axis(model, index)]
    at = model.part_index
    return replace(
        model,
        height_m=sizes.height_m,
        joints=tuple(_moved(j, along[at[j.parent]], widths) if j.parent else j for j in model.joints),
        parts=tuple(_stretched(p, stretch[i], along[i]) for i, p in enumerate(model.parts)),
        landmarks=tuple(replace(m, position=_scaled(m.position, along[at[m.part]])) for m in model.landmarks),
    )


def scaled(sizes: BodyDimensions, height_m: float) -> BodyDimensions:
    """The same proportions at another height."""
    by = height_m / sizes.height_m
    parts = {
        n: PartDimensions(p.length_m * by, (p.girths_m[0] * by, p.girths_m[1] * by)) for n, p in sizes.parts.items()
    }
    return BodyDimensions(height_m, parts, {n: w * by for n, w in sizes.widths_m.items()})


def mirror_part(name: str) -> str | None:
    """Name of the part or joint on the other side; None for one in the middle."""
    for own, other in (_SIDES, _SIDES[::-1]):
        if name.startswith(own):
            return other + name.removeprefix(own)
    return None


def _check(what: str, size_m: float, height_m: float) -> None:
    if not (np.isfinite(size_m) and _LEAST_M <= size_m <= _MOST_SHARE * height_m):
        raise TrackerError(
            f"expected the {what} to be {_LEAST_M * 100:g} to {_MOST_SHARE * height_m * 100:.0f} cm, "
            f"found {size_m * 100:g}; enter a length of a body {height_m * 100:.0f} cm tall"
        )


def _ends(model: BodyModel, part: int) -> Array:
    """What lies on a part in its frame, (n, 3), fractions of height: its own joint, and the joints and landmarks on it.

    Of two that are one on each side it is what lies between them: how far they are apart is a width, no length.
    """
    name = model.parts[part].name
    on_it: Sequence[Joint | Landmark] = [
        *(j for j in model.joints if j.parent == name),
        *(m for m in model.landmarks if m.part == name),
    ]
    places = {x.name: np.array(x.position) for x in on_it}
    return np.array([np.zeros(3), *((p + places.get(mirror_part(n) or n, p)) / 2 for n, p in places.items())])


def _main_axis(model: BodyModel, part: int) -> int:
    extents = np.ptp(_ends(model, part), axis=0)
    # A part that carries nothing is as long as its shape.
    return int(np.argmax(extents if extents.max() > 1e-6 else model.parts[part].half_axes))


def _length(model: BodyModel, part: int) -> float:
    """Length of a part, fraction of height."""
    axis = _main_axis(model, part)
    extent = float(np.ptp(_ends(model, part)[:, axis]))
    return extent if extent > 1e-6 else 2 * model.parts[part].half_axes[axis]


def _girdles(model: BodyModel) -> list[str]:
    """Those pairs of joints that one part carries, and whose distance is not its length."""
    by_name = {j.name: j for j in model.joints}
    out = []
    for width in _WIDTHS:
        pair = [by_name[f"{side}{width}"] for side in _SIDES if f"{side}{width}" in by_name]
        if len(pair) == 2 and pair[0].parent == pair[1].parent and _half_width(model, width) > 1e-6:
            out.append(width)
    return [w for w in out if _main_axis(model, model.part_index[by_name[f"left_{w}"].parent]) != 1]


def _half_width(model: BodyModel, width: str) -> float:
    left, right = (next(j for j in model.joints if j.name == f"{side}{width}") for side in _SIDES)
    return abs(left.position[1] - right.position[1]) / 2


def _moved(joint: Joint, along: Array, widths: Mapping[str, float]) -> Joint:
    x, y, z = _scaled(joint.position, along)
    width = next((by for name, by in widths.items() if joint.name in (f"left_{name}", f"right_{name}")), 1.0)
    return replace(joint, position=(x, y * width, z))


def _stretched(part: Part, stretch: Array, along: Array) -> Part:
    return replace(part, half_axes=_scaled(part.half_axes, stretch), center=_scaled(part.center, along))


def _scaled(place: Sequence[float], by: Array) -> tuple[float, float, float]:
    x, y, z = (float(c * s) for c, s in zip(place, by, strict=True))
    return x, y, z
