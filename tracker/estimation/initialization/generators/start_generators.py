"""Propose start poses of one person on one frame: from voxels, on the body's axis, and by search along the figure.

A generator proposes; `initialization` fits, tracks and compares. Another one is an entry of `GENERATORS`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.extensions import Extended
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization.generators.axis_start import search_on_axes
from tracker.estimation.initialization.generators.body_axis import BodyAxis, find_body_axes
from tracker.estimation.initialization.generators.person_scene import PersonScene, silhouette_axes
from tracker.estimation.initialization.generators.silhouette_overlap import SilhouetteOverlap
from tracker.estimation.initialization.generators.standing_body import ROUNDED, WITH_HANDS, typical_person
from tracker.estimation.initialization.generators.stature import height_of_parts, possible_parts, standing_height
from tracker.estimation.initialization.generators.voxel_start import start_pose, turned_round
from tracker.evidence.voxels.part_size import principal_axes
from tracker.formats.model_toml import DEFAULT_HEIGHT_M

_AXES_TRIED = 3
"""Places of the head along an axis that are tried."""


def from_voxels(scene: PersonScene, model: BodyModel, is_known: bool) -> list[Hypothesis]:
    """Return starts from the parts that voxels show (MTHC01 Sect. 3), one for each head and way of facing.

    Args:
        scene: the person on a frame.
        model: the body.
        is_known: whether its height is known; else it is measured, if the person stands.

    Raises:
        TrackerError: no head with a trunk is found.
    """
    starts: list[Hypothesis] = []
    for parts in possible_parts(scene):
        height_m = None if is_known else height_of_parts(scene, parts)
        own = model if height_m is None else model.with_height(height_m)
        is_measured = is_known or height_m is not None
        for facing in (parts, turned_round(parts)):
            listed = ", ".join(n.replace("_", " ") for n in facing.unresolved)
            notes = (f"not resolved by the voxels, which show them as one with the body: {listed}",) if listed else ()
            body = PosedBody(own, start_pose(own, facing))
            starts.append(Hypothesis(body, "voxels", is_measured=is_measured, notes=notes))
    return starts


def from_axis(scene: PersonScene, model: BodyModel, is_known: bool) -> list[Hypothesis]:
    """Return starts on the axis of the silhouettes (GD96 Sect. 4.1), one for each way of facing.

    Views in which others cover the person are left out if two remain. See `from_voxels`.

    Raises:
        TrackerError: fewer than two views agree on an axis, or no head is found along it.
    """
    person = typical_person(model.height_m / DEFAULT_HEIGHT_M, ROUNDED)
    axes = find_body_axes(silhouette_axes(scene), scene.up, person)[:_AXES_TRIED]
    best = axes[0]
    height_m = None if is_known else standing_height(scene, best.up, best.top)
    own = model if height_m is None else model.with_height(height_m)
    return _on_axes("axis", scene, own, axes, is_known or height_m is not None)


def from_search(scene: PersonScene, model: BodyModel, is_known: bool) -> list[Hypothesis]:
    """Return starts from a search along the figure's longest axis, with the head near either end.

    It needs no head that stands out. See `from_voxels`.
    """
    found = principal_axes(scene.figure.points_world, scene.figure.grid.size_m)
    up = found.axes[:, 2] * (1.0 if found.axes[:, 2] @ scene.up >= 0 else -1.0)
    person = typical_person(model.height_m / DEFAULT_HEIGHT_M, WITH_HANDS)
    raised_m = person.segments_m("arm").sum() - person.below_crown_m("left_shoulder")  # hands may be above the head
    starts: list[Hypothesis] = []
    for direction in (up, -up):
        top = found.center + float(((scene.figure.points_world - found.center) @ direction).max()) * direction
        tops = (top - m * direction for m in np.linspace(0.0, raised_m, _AXES_TRIED))
        axes = [BodyAxis(direction, t, np.nan, (), ()) for t in tops]
        # Spread arms look like legs: both ends are kept, and the fits decide.
        starts += _on_axes("search", scene, model, axes, is_known)
    return starts


StartGenerator: TypeAlias = Callable[[PersonScene, BodyModel, bool], list[Hypothesis]]
"""Proposes starts from the person on a frame, the body, and whether its height is known."""
_OWN: dict[str, StartGenerator] = {"voxels": from_voxels, "axis": from_axis, "search": from_search}
GENERATORS = Extended(_OWN, "quadrille.starts")
"""Each generator by name, in the order of their cost, in which they are tried; those of other packages come last."""


def _on_axes(
    generator: str, scene: PersonScene, model: BodyModel, axes: Sequence[BodyAxis], is_measured: bool
) -> list[Hypothesis]:
    masks, cameras = zip(*scene.clear_views, strict=True)
    overlap = SilhouetteOverlap(model, masks, cameras, scene.figure.points_world.mean(axis=0))
    starts = search_on_axes(model, overlap, axes)
    return [replace(start, source=generator, is_measured=is_measured) for start in starts]
