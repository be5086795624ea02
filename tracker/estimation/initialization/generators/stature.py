"""Measure the height of a person who stands upright on a frame."""

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.initialization.generators.head_template import Head
from tracker.estimation.initialization.generators.person_scene import PersonScene
from tracker.estimation.initialization.generators.standing_body import typical_person
from tracker.estimation.initialization.generators.voxel_start import FigureParts, locate_parts, possible_heads
from tracker.evidence.voxels.geodesic_distance import neighbor_graph
from tracker.evidence.voxels.shadows import is_changed_at
from tracker.geometry.arrays import Array

UPRIGHT = 0.9
"""Smallest cosine of the angle between the trunk and the vertical of a person who stands."""


HEIGHT_SIGMA = 0.02
"""Standard deviation of the logarithm of a height that was measured: shoes, hair and a voxel at both ends."""
_MAX_PATH = 1.25
"""Largest path from the top of the head to the soles, as a share of a standing person's height. Folded legs make it
longer. The grid lengthens paths by up to a tenth."""
_MAX_HIDDEN_M = 0.15
"""Largest height of shoes that shadows hide, metres."""


def possible_parts(scene: PersonScene) -> list[FigureParts]:
    """Return the parts of a figure with each head that it may have, the most likely first.

    Raises:
        TrackerError: there is no head, or none with a trunk.
    """
    found, errors, graph = list[FigureParts](), list[TrackerError](), neighbor_graph(scene.figure)
    for head in possible_heads(scene.figure, graph, scene.up):
        try:
            found.append(locate_parts(scene.figure, graph, head))
        except TrackerError as error:
            errors.append(error)
    if not found:
        raise errors[0]
    return found


def upright_height(scene: PersonScene) -> float | None:
    """Return the height of a person by the most likely head that stands upright, metres; None if none does."""
    try:
        heights = (height_of_parts(scene, parts) for parts in possible_parts(scene))
        return next((h for h in heights if h is not None), None)
    except TrackerError:
        return None


def height_of_parts(scene: PersonScene, parts: FigureParts) -> float | None:
    """Return the height of a person by the parts of the figure, metres; None if the person does not stand upright."""
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
    if trunk_up @ scene.up < UPRIGHT:
        return None
    low = _soles(scene)
    height_m = float(top @ scene.up) - low
    if head is None:
        return height_m
    # Folded legs and hands on the head change the share of the height at which the neck is.
    neck, person = (float(head.neck @ scene.up) - head.joint_below_m - low) / height_m, typical_person(head.scale)
    usual = 1 - person.below_crown_m("neck") / person.height_m
    stands = abs(neck / usual - 1) < 2 * HEIGHT_SIGMA and head.path_m <= _MAX_PATH * height_m
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
