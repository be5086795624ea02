"""Find the head of a figure by a spherical crust template (MTHC01 Sect. 3).

The paper counts the surface voxels within the crust. A trunk may hold as many. A head also has nothing around it but
the neck, so that the occupied voxels in a shell around the crust are subtracted. And it is an end of the figure, which
falls apart without a knee or an elbow.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.initialization.generators.standing_body import typical_person
from tracker.evidence.voxels.figure_masks import STRAY
from tracker.evidence.voxels.geodesic_distance import VoxelGraph, path_lengths
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array


class Template(NamedTuple):
    """A crust that holds the surface of a head, and the shell around it."""

    inner_m: float
    """Inner radius of the crust, metres: half the smallest dimension of a head."""
    outer_m: float
    """Outer radius of the crust, metres: half the largest dimension."""
    surrounding_m: float
    """Outer radius of the shell in which a head has only its neck, metres."""
    min_score: float
    """Smallest score of a head: the surface voxels in the crust less the voxels around it. The unit is the number of
    surface voxels of a sphere of the crust's mean radius."""


_TEMPLATES = (Template(0.07, 0.135, 0.20, 0.25), Template(0.055, 0.11, 0.13, 0.5))
"""In the order in which they are tried. The first has half the smallest and half the largest dimension of an adult's
head. Hands and feet in the hull of few views do not pass its wide shell. The second also fits heads beside an arm, and
heads of children, whose shoulders are near."""
_MIN_UPPER_SCORE = 0.4
"""Smallest score of a head at the upper end of a figure."""
_ADULT_M3 = 0.10
"""Volume of the visual hull of a typical adult, cubic metres."""


class Head(NamedTuple):
    """The head of a figure."""

    center: Array
    """Centre of its voxels, (3,), metres."""
    neck: Array
    """Mean of its voxels that touch the rest of the body, (3,), metres."""
    joint_below_m: float
    """Depth of the joint of the neck below these, metres."""
    is_head: NDArray[np.bool_]
    """Whether each voxel of the figure belongs to it, (N,)."""
    score: float
    """See `Template.min_score`."""
    path_m: float
    """Length of the longest path through the body from the top of the head, metres: with straight legs the stature."""
    scale: float
    """Size of the person, as a share of an adult's, at most 1."""


def find_head(figure: Voxels, graph: VoxelGraph) -> Head | None:
    """Return the most likely head of a figure, however it lies; None if no place scores enough or nothing is beside it.

    Args:
        figure: voxels of one person, at most about 5 cm each.
        graph: their `neighbor_graph`.
    """
    place = next((p for t in _TEMPLATES for p in _ends(figure, _scores(figure, t), t)), None)
    return None if place is None else _head(figure, graph, place)


def find_upper_head(figure: Voxels, graph: VoxelGraph, up: Array) -> Head | None:
    """Return the head at the upper end of a figure; None if no place there scores enough.

    Beside broad shoulders a head scores less than a hand or a foot may do. People seldom stand on their heads.

    Args:
        figure: voxels of one person, at most about 5 cm each.
        graph: their `neighbor_graph`.
        up: vertical axis of the world, (3,).
    """
    heights, (adult, template) = figure.points_world @ up, _TEMPLATES
    upper_m = 2 * adult.outer_m  # a head's length
    scores = np.where(heights > heights.max() - upper_m, _scores(figure, template), -np.inf)
    place = next(_ends(figure, scores, template._replace(min_score=_MIN_UPPER_SCORE)), None)
    return None if place is None else _head(figure, graph, place)


class _Place(NamedTuple):
    """A place that may be the centre of a head."""

    score: float
    """See `Template.min_score`."""
    distances: Array
    """Of the figure's voxels from there, (N,), metres."""
    radius_m: float
    """Radius of the head there, metres."""


def _scores(figure: Voxels, template: Template) -> Array:
    """Return the score of a template at each voxel of a figure, (N,)."""
    from scipy.signal import fftconvolve  # imported lazily: loading it takes 0.5 s

    size, (inner_m, outer_m, surrounding_m, _) = figure.grid.size_m, template
    reach = int(np.ceil(surrounding_m / size))
    distance = size * np.sqrt(np.sum(np.square(np.indices((2 * reach + 1,) * 3) - reach), axis=0))
    crust = ((distance >= inner_m) & (distance <= outer_m)).astype(np.float64)
    around = ((distance > outer_m + size / 2) & (distance <= surrounding_m)).astype(np.float64)
    surface = np.zeros(figure.grid.shape)
    surface[tuple(figure.indices[figure.is_surface].T)] = 1.0
    counts = fftconvolve(surface, crust, mode="same")
    counts -= fftconvolve(figure.occupied.astype(np.float64), around, mode="same")
    expected = np.pi * (inner_m + outer_m) ** 2 / size**2
    return np.asarray(counts[tuple(figure.indices.T)] / expected)


def _ends(figure: Voxels, scores: Array, template: Template) -> Iterator[_Place]:
    """Yield the places that are ends of a figure and score enough, from the highest score down."""
    points, left = figure.points_world, scores.copy()
    while left[best := int(np.argmax(left))] >= template.min_score:
        distances = np.linalg.norm(points - points[best], axis=1)
        is_near = distances <= template.outer_m
        if _is_end(figure, is_near):
            yield _Place(float(left[best]), distances, template.outer_m)
        left[is_near] = -np.inf


def _head(figure: Voxels, graph: VoxelGraph, place: _Place) -> Head | None:
    """Return the head at a place; None if nothing is beside it."""
    points = figure.points_world
    lengths = path_lengths(graph, place.distances <= place.radius_m, figure.grid.size_m)
    path_m = place.radius_m + float(lengths[np.isfinite(lengths)].max())
    # A person cut off by an image has short paths, yet the volume of more than a child.
    scale = min(1.0, max(path_m / DEFAULT_HEIGHT_M, float(np.cbrt(figure.volume_m3 / _ADULT_M3))))
    is_head = place.distances <= typical_person(scale).head_radius_m + figure.grid.size_m / 2
    neck = _neck_position(figure, is_head)
    if neck is None:
        return None
    center = points[is_head].mean(axis=0)
    below_m = typical_person(scale).neck_m - float(np.linalg.norm(neck - center))
    return Head(center, neck, below_m, is_head, place.score, path_m, scale)


def _is_end(figure: Voxels, is_head: NDArray[np.bool_]) -> bool:
    """Return whether the rest of a figure is one piece without some voxels, (N,)."""
    rest = figure.without(is_head)
    largest = rest.components(min_share=1.0)[:1]
    cut_off = len(rest.indices) - sum(len(v.indices) for v in largest)
    return bool(largest) and cut_off <= STRAY * len(is_head)


def _neck_position(figure: Voxels, is_head: NDArray[np.bool_]) -> Array | None:
    from scipy.ndimage import binary_dilation

    beside = binary_dilation(figure.without(is_head).occupied, np.ones((3, 3, 3), dtype=bool))[tuple(figure.indices.T)]
    touching = is_head & beside
    return figure.points_world[touching].mean(axis=0) if touching.any() else None
