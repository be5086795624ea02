"""Dimensions of a body as people measure and enter them: lengths and girths of its parts, widths of shoulders and hips.

A part's main axis is the one along which its joints and landmarks lie farthest apart. Their distance is the part's
length; a new length stretches everything on the part. Across the axis are two half girths, at the middle of the shape.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel
from tracker.body.parts import Joint, Landmark, Part
from tracker.errors import TrackerError
from tracker.geometry.arrays import TINY, Array

HEIGHT_LIMITS_M = (0.3, 3.0)
"""Least and largest height of a body, metres."""
STATED_HEIGHT_SIGMA = 0.0055
"""Standard deviation of the logarithm of a height that somebody states: people lose 1.1% of it over a day (Tyrrell et
al. 1985), and nobody says at which hour it was measured."""
MIN_PART_M, _MAX_SHARE = 0.005, 0.7
"""Shortest dimension of a part, metres; longest, as a share of the body's height."""
_SIDES = ("left_", "right_")
_WIDTHS = ("shoulder", "hip")
"""Pairs of joints, left and right, whose distance is a dimension of its own if one part carries both."""


class PartDimensions(NamedTuple):
    """The dimensions of one part."""

    length_m: float
    """Distance between the joints and landmarks on it, or from its own joint, metres."""
    girths_m: tuple[float, float]
    """Half its thickness across, front to back and side to side (up and down for a part that lies across), metres."""


class BodyDimensions(NamedTuple):
    """The dimensions of a body."""

    height_m: float
    """Body height, by which everything is scaled, metres."""
    parts: Mapping[str, PartDimensions]
    """Dimensions of each part by name."""
    widths_m: Mapping[str, float]
    """Distance of the two shoulders or hips by name (`hip`), if one part carries both, metres."""


def dimensions_of(model: BodyModel) -> BodyDimensions:
    """Measure the dimensions of a body."""
    parts = {}
    for index, part in enumerate(model.parts):
        axis = main_axis(model, index)
        across = [a for a in range(3) if a != axis]
        girths = (part.half_axes[across[0]] * model.height_m, part.half_axes[across[1]] * model.height_m)
        parts[part.name] = PartDimensions(_length(model, index) * model.height_m, girths)
    return BodyDimensions(
        model.height_m, parts, {w: 2 * _half_width(model, w) * model.height_m for w in _girdles(model)}
    )


def with_dimensions(model: BodyModel, sizes: BodyDimensions) -> BodyModel:
    """Return the same body with other dimensions.

    Args:
        model: the body.
        sizes: all dimensions, as `dimensions_of` returns them.

    Raises:
        TrackerError: a dimension is not possible for a body.
    """
    lowest_m, highest_m = HEIGHT_LIMITS_M
    if not lowest_m <= sizes.height_m <= highest_m:
        raise TrackerError(
            f"expected a height of {lowest_m * 100:g} to {highest_m * 100:g} cm, "
            f"found {sizes.height_m * 100:g}; enter the person's own"
        )
    stretch = np.ones((len(model.parts), 3))  # of each part along its axes
    for index, part in enumerate(model.parts):
        wanted, axis = sizes.parts[part.name], main_axis(model, index)
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
        along[index, main_axis(model, index)] = stretch[index, main_axis(model, index)]
    at = model.part_index
    return replace(
        model,
        height_m=sizes.height_m,
        joints=tuple(
            _moved(j, along[at[j.parent]], stretch[at[j.parent]], widths)
            if j.parent
            else replace(j, center_offset=_scaled(j.center_offset, stretch[0]))
            for j in model.joints
        ),
        parts=tuple(_stretched(p, stretch[i], along[i]) for i, p in enumerate(model.parts)),
        landmarks=tuple(
            replace(
                m,
                position=_scaled(m.position, along[at[m.part]]),
                center_offset=_scaled(m.center_offset, stretch[at[m.part]]),
            )
            for m in model.landmarks
        ),
    )


def with_sizes_of(model: BodyModel, source: BodyModel) -> BodyModel:
    """Return a body with the height of another, and with the sizes of its parts as far as they correspond.

    Parts correspond if they have the same name and the same joints and landmarks at their ends: a rigid trunk has none
    of the lengths of one that bends. The others keep their proportions.
    """
    base = replace(model, height_m=source.height_m, height_sigma=source.height_sigma)
    own, other = dimensions_of(base), dimensions_of(source)
    same = [n for n in own.parts.keys() & other.parts.keys() if {*_points_on(base, n)} == {*_points_on(source, n)}]
    parts = {**own.parts, **{name: other.parts[name] for name in same}}
    widths = {name: other.widths_m.get(name, width_m) for name, width_m in own.widths_m.items()}
    return with_dimensions(base, BodyDimensions(source.height_m, parts, widths))


def stature_m(model: BodyModel) -> float:
    """Return the vertical extent of a body that stands straight, from crown to sole, metres."""
    sole_m, crown_m = standing_extent_m(model)
    return crown_m - sole_m


def standing_extent_m(model: BodyModel) -> tuple[float, float]:
    """Return the heights of sole and crown over the root of a body that stands straight, metres."""
    Ts = model.kinematics(model.neutral()).Ts_world_part
    ends = []
    for shape, center, T in zip(model.shapes, model.centers_part, Ts, strict=True):
        z = (shape.triangles().vertices + center) @ T[2, :3] + T[2, 3]
        ends += [float(z.min()), float(z.max())]
    return min(ends), max(ends)


def restate_height(model: BodyModel, like: BodyModel) -> BodyModel:
    """Return the very same body with its height stated as its stature, in the ratio of another body's.

    A body's height is the unit of its fractions. With other lengths of parts it no longer is how tall the body is.
    """
    height_m = like.height_m * stature_m(model) / stature_m(like)
    by = model.height_m / height_m

    def unchanged(at: tuple[float, float, float]) -> tuple[float, float, float]:
        return _scaled(at, np.full(3, by))

    return replace(
        model,
        height_m=height_m,
        joints=tuple(
            replace(j, position=unchanged(j.position), center_offset=unchanged(j.center_offset)) for j in model.joints
        ),
        parts=tuple(replace(p, center=unchanged(p.center), half_axes=unchanged(p.half_axes)) for p in model.parts),
        landmarks=tuple(
            replace(m, position=unchanged(m.position), center_offset=unchanged(m.center_offset))
            for m in model.landmarks
        ),
    )


def scaled(sizes: BodyDimensions, height_m: float) -> BodyDimensions:
    """Return the same proportions at another height."""
    by = height_m / sizes.height_m
    parts = {
        n: PartDimensions(p.length_m * by, (p.girths_m[0] * by, p.girths_m[1] * by)) for n, p in sizes.parts.items()
    }
    return BodyDimensions(height_m, parts, {n: w * by for n, w in sizes.widths_m.items()})


def size_limits_m(height_m: float) -> tuple[float, float]:
    """Return the least and the largest dimension of a part of a body of a height, metres."""
    return MIN_PART_M, _MAX_SHARE * height_m


def mirror_part(name: str) -> str | None:
    """Return the name of the part or joint on the other side; None for one in the middle."""
    for own, other in (_SIDES, _SIDES[::-1]):
        if name.startswith(own):
            return other + name.removeprefix(own)
    return None


def _check(what: str, size_m: float, height_m: float) -> None:
    least_m, largest_m = size_limits_m(height_m)
    if not (np.isfinite(size_m) and least_m <= size_m <= largest_m):
        raise TrackerError(
            f"expected the {what} to be {least_m * 100:g} to {largest_m * 100:.0f} cm, "
            f"found {size_m * 100:g}; enter a length of a body {height_m * 100:.0f} cm tall"
        )


def _points_on(model: BodyModel, part: str) -> dict[str, Array]:
    """Return where joints and landmarks lie on a part, by name, in its frame, fractions of height."""
    on_it: Sequence[Joint | Landmark] = [
        *(j for j in model.joints if j.parent == part),
        *(m for m in model.landmarks if m.part == part),
    ]
    return {x.name: np.array(x.position) for x in on_it}


def _ends(model: BodyModel, part: int) -> Array:
    """Collect the points on a part in its frame, (n, 3), fractions of height: its joint, further joints, landmarks.

    A left and right pair counts as its midpoint, because the distance of the pair is a width and not a length.
    """
    places = _points_on(model, model.parts[part].name)
    return np.array([np.zeros(3), *((p + places.get(mirror_part(n) or n, p)) / 2 for n, p in places.items())])


def main_axis(model: BodyModel, part: int) -> int:
    """Return the axis of a part, given by index, along which its length is measured: 0, 1 or 2."""
    extents = np.ptp(_ends(model, part), axis=0)
    # A part without further points is as long as its shape.
    return int(np.argmax(extents if extents.max() > TINY else model.parts[part].half_axes))


def _length(model: BodyModel, part: int) -> float:
    """Return the length of a part, fraction of height."""
    axis = main_axis(model, part)
    extent = float(np.ptp(_ends(model, part)[:, axis]))
    return extent if extent > TINY else 2 * model.parts[part].half_axes[axis]


def _girdles(model: BodyModel) -> list[str]:
    """List the pairs of joints on one part whose distance is not the part's length."""
    by_name = {j.name: j for j in model.joints}
    out = []
    for width in _WIDTHS:
        pair = [by_name[f"{side}{width}"] for side in _SIDES if f"{side}{width}" in by_name]
        if len(pair) == 2 and pair[0].parent == pair[1].parent and _half_width(model, width) > TINY:
            out.append(width)
    return [w for w in out if main_axis(model, model.part_index[by_name[f"left_{w}"].parent]) != 1]


def _half_width(model: BodyModel, width: str) -> float:
    left, right = (next(j for j in model.joints if j.name == f"{side}{width}") for side in _SIDES)
    return abs(left.position[1] - right.position[1]) / 2


def _moved(joint: Joint, along: Array, stretch: Array, widths: Mapping[str, float]) -> Joint:
    """Move a joint with its parent part; the offset of its centre follows the part's girths too."""
    x, y, z = _scaled(joint.position, along)
    width = next((by for name, by in widths.items() if joint.name in (f"left_{name}", f"right_{name}")), 1.0)
    return replace(joint, position=(x, y * width, z), center_offset=_scaled(joint.center_offset, stretch))


def _stretched(part: Part, stretch: Array, along: Array) -> Part:
    return replace(part, half_axes=_scaled(part.half_axes, stretch), center=_scaled(part.center, along))


def _scaled(place: Sequence[float], by: Array) -> tuple[float, float, float]:
    x, y, z = (float(c * s) for c, s in zip(place, by, strict=True))
    return x, y, z
