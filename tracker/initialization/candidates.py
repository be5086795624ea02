"""Start poses of one person on one frame by each method: voxels, the body's axis, and search along the figure."""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane
from tracker.initialization.axis_start import AxisStart, search_on_axes
from tracker.initialization.body_axis import BodyAxis, find_body_axes
from tracker.initialization.head_template import Head
from tracker.initialization.silhouette_axis import MajorAxis, major_axis
from tracker.initialization.silhouette_overlap import SilhouetteOverlap
from tracker.initialization.voxel_start import (
    FigureParts,
    facing_cues,
    locate_parts,
    possible_heads,
    start_pose,
    turned_round,
)
from tracker.voxels.figure_masks import FigureMask
from tracker.voxels.part_size import principal_axes
from tracker.voxels.paths import neighbor_graph
from tracker.voxels.shadows import is_changed_at
from tracker.voxels.voxel_grid import Voxels

StartMethod: TypeAlias = Literal["voxels", "axis", "search"]

_UPRIGHT = 0.9
"""Smallest cosine of the angle between the trunk and the vertical of a person who stands."""
_NECK, _NECK_GROWTH, _NECK_SPREAD = 0.70, 0.18, 0.04
"""Height of the base of a standing person's head, as a fraction of the body's height. It is a constant plus a slope by
the person's size as a share of an adult's; the last number is its largest relative error. Folded legs and hands on the
head change it."""
_MAX_PATH = 1.25
"""Largest path from the top of the head to the soles, as a share of a standing person's height. Folded legs make it
longer. The grid lengthens paths by up to a tenth."""
_MAX_HIDDEN_M = 0.15
"""Largest height of shoes that shadows hide, metres."""
_AXES_TRIED = 3
_RAISED = (0.0, 0.10, 0.20)
"""Tops of the head that a search tries, below the end of the figure, as fractions of the height: hands may be above."""


class PersonScene(NamedTuple):
    """One person on a frame before any pose is known."""

    figure: Voxels
    """Voxels of the person."""
    silhouettes: Sequence[ViewSilhouette]
    """Of all views."""
    masks: Sequence[FigureMask]
    """Silhouettes of the person, of all views."""
    floor: GroundPlane
    """The floor."""
    motion: Array | None
    """The way of the person to later frames, (3,), metres; None if it is not known."""

    @property
    def up(self) -> Array:
        """Vertical axis of the world, (3,)."""
        return self.floor.normal

    @property
    def clear_views(self) -> list[tuple[Mask, Camera]]:
        """Masks and cameras of the views that show the person alone; of all views if fewer than two do."""
        pairs = list(zip(self.masks, self.silhouettes, strict=True))
        alone = [(m.mask, s.camera) for m, s in pairs if m.shows_figure_alone]
        return alone if len(alone) >= 2 else [(m.mask, s.camera) for m, s in pairs]


class StartCandidate(NamedTuple):
    """A start pose before the fit to contours."""

    method: StartMethod
    model: BodyModel
    """The body, with the height that was measured."""
    pose: Array
    """(n_values,)."""
    forward: Array
    """Unit direction in which the trunk faces, (3,)."""
    cues: float
    """Sum of the cues of feet, bends and motion for that direction; below 0 they favour the opposite one."""
    unresolved: tuple[str, ...] = ()
    """Limbs that the method does not separate from the rest of the body."""
    straight: tuple[str, ...] = ()
    """Limbs whose middle joint follows from proportions."""
    axis: BodyAxis | None = None
    """The axis of the body, where the method found one."""
    is_measured: bool = True
    """Whether the height of the body was measured, or was known."""


def from_voxels(scene: PersonScene, model: BodyModel, is_known: bool) -> list[StartCandidate]:
    """Return starts from the parts that voxels show (MTHC01 Sect. 3), one for each head and way of facing.

    Args:
        scene: the person on a frame.
        model: the body.
        is_known: whether its height is known; else it is measured, if the person stands.

    Raises:
        TrackerError: no head with a trunk is found.
    """
    starts: list[StartCandidate] = []
    for parts in _possible_parts(scene):
        height_m = None if is_known else _height_of_parts(scene, parts)
        own = model if height_m is None else model.with_height(height_m)
        starts += [
            StartCandidate(
                "voxels", own, start_pose(own, p), p.torso.axes[:, 0], sign * p.facing, p.unresolved, p.straight,
                None, is_known or height_m is not None,
            )
            for sign, p in ((1.0, parts), (-1.0, turned_round(parts)))
        ]  # fmt: skip
    return starts


def _possible_parts(scene: PersonScene) -> list[FigureParts]:
    """Return the parts of a figure with each head that it may have, the most likely first.

    Raises:
        TrackerError: there is no head, or none with a trunk.
    """
    found, errors, graph = list[FigureParts](), list[TrackerError](), neighbor_graph(scene.figure)
    for head in possible_heads(scene.figure, graph, scene.up):
        try:
            found.append(locate_parts(scene.figure, graph, head, scene.motion))
        except TrackerError as error:
            errors.append(error)
    if not found:
        raise errors[0]
    return found


def from_axis(scene: PersonScene, model: BodyModel, is_known: bool) -> list[StartCandidate]:
    """Return starts on the axis of the silhouettes (GD96 Sect. 4.1), one for each way of facing.

    Views in which others cover the person are left out if two remain. See `from_voxels`.

    Raises:
        TrackerError: fewer than two views agree on an axis, or no head is found along it.
    """
    axes = find_body_axes(silhouette_axes(scene), scene.up, model.height_m)[:_AXES_TRIED]
    best = axes[0]
    height_m = None if is_known else standing_height(scene, best.up, best.top)
    own = model if height_m is None else model.with_height(height_m)
    return _on_axes("axis", scene, own, axes, is_known or height_m is not None)


def from_search(scene: PersonScene, model: BodyModel, is_known: bool) -> list[StartCandidate]:
    """Return starts from a search along the figure's longest axis, with the head near either end.

    It needs no head that stands out. See `from_voxels`.
    """
    found = principal_axes(scene.figure.points_world, scene.figure.grid.size_m)
    up = found.axes[:, 2] * (1.0 if found.axes[:, 2] @ scene.up >= 0 else -1.0)
    starts: list[StartCandidate] = []
    for direction in (up, -up):
        top = found.center + float(((scene.figure.points_world - found.center) @ direction).max()) * direction
        axes = [BodyAxis(direction, top - s * model.height_m * direction, np.nan, (), ()) for s in _RAISED]
        # Spread arms look like legs: both ends are kept, and the fits decide.
        starts += _on_axes("search", scene, model, axes, is_known)
    return starts


METHODS: Mapping[StartMethod, Callable[[PersonScene, BodyModel, bool], list[StartCandidate]]] = {
    "voxels": from_voxels,
    "axis": from_axis,
    "search": from_search,
}
"""Each method by name, in the order in which they are tried."""


def silhouette_axes(scene: PersonScene) -> list[MajorAxis]:
    """Return the major axes of a person's silhouettes in the views that show the person alone.

    Raises:
        TrackerError: fewer than two views show the person.
    """
    axes = [a for mask, camera in scene.clear_views if (a := major_axis(mask, camera)) is not None]
    if len(axes) < 2:
        raise TrackerError(
            f"expected the person in at least 2 views, found {len(axes)}", Remedy("another_frame_or_background")
        )
    return axes


def upright_height(scene: PersonScene) -> float | None:
    """Return the height of a person by the most likely head that stands upright, metres; None if none does."""
    try:
        heights = (_height_of_parts(scene, parts) for parts in _possible_parts(scene))
        return next((h for h in heights if h is not None), None)
    except TrackerError:
        return None


def _height_of_parts(scene: PersonScene, parts: FigureParts) -> float | None:
    points = scene.figure.points_world[parts.head.is_head]
    top = points[int(np.argmax(points @ scene.up))] + scene.figure.grid.size_m / 2 * scene.up
    return standing_height(scene, parts.torso.axes[:, 2], top, parts.head)


def standing_height(scene: PersonScene, trunk_up: Array, top: Array, head: Head | None = None) -> float | None:
    """Return the height of a person who stands upright, metres; None if the person does not.

    Args:
        scene: the person on a frame.
        trunk_up: direction of the trunk towards the head, (3,).
        top: top of the head, (3,), metres; raised hands are above it.
        head: the head, where voxels show it.
    """
    if trunk_up @ scene.up < _UPRIGHT:
        return None
    low = _soles(scene)
    height_m = float(top @ scene.up) - low
    if head is None:
        return height_m
    neck = (float(head.neck @ scene.up) - low) / height_m
    usual = _NECK + _NECK_GROWTH * head.scale
    stands = abs(neck / usual - 1) < _NECK_SPREAD and head.path_m <= _MAX_PATH * height_m
    return height_m if stands else None


def _soles(scene: PersonScene) -> float:
    """Return the height of the soles along the vertical axis, metres: that of the lowest voxels, or the floor's.

    Shoes are lost in the shadow around them. The person stands on the floor if all views show a change all the way down
    from a lowest voxel.
    """
    points, size_m = scene.figure.points_world, scene.figure.grid.size_m
    heights = points @ scene.up
    low = float(heights.min()) - size_m / 2
    depths = np.arange(size_m, low - scene.floor.offset_m + size_m / 2, size_m)
    if not len(depths) or depths[-1] > _MAX_HIDDEN_M:
        return low
    below = points[heights < low + size_m, None] - depths[:, None] * scene.up
    is_changed = np.all([is_changed_at(s, below.reshape(-1, 3)) for s in scene.silhouettes], axis=0)
    return scene.floor.offset_m if is_changed.reshape(below.shape[:2]).all(axis=1).any() else low


def _feet_up(scene: PersonScene, axis: BodyAxis) -> Array:
    """Return the direction from the feet upwards, (3,): a standing person's soles are on the ground, bent or not."""
    return scene.up if axis.up @ scene.up > _UPRIGHT else axis.up


def _on_axes(
    method: StartMethod, scene: PersonScene, model: BodyModel, axes: Sequence[BodyAxis], is_measured: bool
) -> list[StartCandidate]:
    masks, cameras = zip(*scene.clear_views, strict=True)
    overlap = SilhouetteOverlap(model, masks, cameras, scene.figure.points_world.mean(axis=0))
    starts: list[AxisStart] = search_on_axes(model, overlap, axes, scene.up)
    return [
        StartCandidate(
            method, model, start.pose, start.forward,
            facing_cues(scene.figure, start.forward, _feet_up(scene, start.axis), scene.motion),
            axis=start.axis, is_measured=is_measured,
        )
        for start in starts
    ]  # fmt: skip
