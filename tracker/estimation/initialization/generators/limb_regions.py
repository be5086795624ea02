"""Find the limbs of a figure as connected regions beside the torso, and divide them (MTHC01 Sect. 3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.initialization.generators.standing_body import typical_person
from tracker.estimation.initialization.generators.torso_template import Torso
from tracker.evidence.voxels.figure_masks import STRAY
from tracker.evidence.voxels.geodesic_distance import VoxelGraph, path_lengths
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array, IntArray

_ROOTS = {"arm": "shoulder", "leg": "hip"}


class LimbRegion(NamedTuple):
    """One limb of a figure."""

    kind: str
    """`arm` or `leg`."""
    proximal: Array
    """Place at which it leaves the torso, (3,), metres."""
    middle: Array
    """Elbow or knee, (3,), metres."""
    distal: Array
    """Wrist or ankle, (3,), metres."""
    indices: IntArray
    """Its voxels, indices into those of the figure, (n,)."""

    def scaled(self, factor: float) -> "LimbRegion":
        """Return it in a figure that is larger by a factor about the world's origin."""
        places = {n: getattr(self, n) * factor for n in ("proximal", "middle", "distal")}
        return self._replace(**places)


def find_limbs(figure: Voxels, graph: VoxelGraph, torso: Torso, is_head: NDArray[np.bool_]) -> list[LimbRegion]:
    """Return the limbs that stand out, at most four, the largest first.

    Args:
        figure: voxels of one person.
        graph: their `neighbor_graph`.
        torso: its torso.
        is_head: which voxels belong to the head, (N,).
    """
    points, size_m = figure.points_world, figure.grid.size_m
    distances = path_lengths(graph, torso.is_torso | is_head, size_m)
    # Voxels as close to the torso as an arm beside it belong to its skin, which would connect the limbs.
    skin_m = typical_person().thickness_m("arm") + size_m
    whole = np.flatnonzero(np.isfinite(distances) & (distances > skin_m))
    branches = _branches(figure, whole, distances, skin_m)
    found = [_limb(points, b, distances, torso, size_m) for b in branches]
    return sorted(found, key=lambda limb: -len(limb.indices))


class _Branch(NamedTuple):
    own: IntArray
    """Its voxels, indices into those of the figure, (n,)."""
    begins_m: float
    """Distance from the torso at which it stands out."""


def _branches(figure: Voxels, own: IntArray, distances: Array, begins_m: float) -> list[_Branch]:
    """Return the connected regions of voxels beyond a distance, divided where they fork farther out."""
    size_m, n_least = figure.grid.size_m, STRAY * len(figure.indices)
    _, min_limb_m, min_reach_m = typical_person().segments_m("arm")  # a forearm; beyond a fork a hand
    level = begins_m
    while True:
        beyond = own[distances[own] > level]
        regions = [
            r for r in _connected(figure, beyond) if len(r) >= n_least and distances[r].max() - level >= min_reach_m
        ]
        if not regions:
            enough = len(own) >= n_least and distances[own].max() - begins_m >= min_limb_m if len(own) else False
            return [_Branch(own, begins_m)] if enough else []
        if len(regions) > 1 or len(own) == len(distances):
            return [b for r in regions for b in _branches(figure, r, distances, level)]
        if level == begins_m:
            own = regions[0]
        level += size_m


def _connected(figure: Voxels, own: IntArray) -> list[IntArray]:
    """Return the connected regions of some voxels, indices into those of the figure."""
    from scipy.ndimage import label

    occupied = np.zeros(figure.grid.shape, bool)
    at = tuple(figure.indices[own].T)
    occupied[at] = True
    labels, n = label(occupied, np.ones((3, 3, 3)))
    return [own[labels[at] == i + 1] for i in range(n)]


def _limb(points: Array, branch: _Branch, distances: Array, torso: Torso, size_m: float) -> LimbRegion:
    """Return the limb of a branch. Its hidden first stretch is assumed straight, its joints are an adult's.

    Args:
        points: the voxels of the figure, (N, 3).
        branch: the branch.
        distances: of the voxels from the torso, (N,), metres.
        torso: the torso.
        size_m: edge of a voxel, metres.
    """
    region, from_torso, adult = points[branch.own], distances[branch.own], typical_person()
    # Voxels of a child who is enlarged to an adult are wide: there may be none this near.
    first = region[from_torso <= max(branch.begins_m + 2 * size_m, from_torso.min())].mean(axis=0)
    tip = region[from_torso > from_torso.max() - 2 * size_m].mean(axis=0)
    side = "left" if torso.local(first[None])[0, 1] > 0 else "right"
    roots = {k: torso.neck_joint + torso.axes @ adult.from_neck(f"{side}_{j}") for k, j in _ROOTS.items()}
    hand_m = adult.from_neck("left_shoulder")[2] - adult.segments_m("arm").sum()
    is_on_trunk = branch.begins_m < adult.thickness_m("arm") + 3 * size_m  # not at a fork farther out
    is_low = (tip - torso.neck_joint) @ torso.axes[:, 2] < hand_m
    nearest = min(roots, key=lambda k: float(np.linalg.norm(first - roots[k])))
    kind = "leg" if is_low or (is_on_trunk and nearest == "leg") else "arm"
    segments = adult.segments_m(kind)
    hidden_m = float(np.linalg.norm(first - roots[kind]))
    length_m = hidden_m + float(from_torso.max()) - branch.begins_m
    begin = (roots[kind], hidden_m, first)
    middle, distal = (
        _at(region, from_torso - branch.begins_m + hidden_m, begin, share * length_m, size_m)
        for share in np.cumsum(segments)[:2] / segments.sum()
    )
    return LimbRegion(kind, roots[kind], middle, distal, branch.own)


def _at(region: Array, lengths: Array, begin: tuple[Array, float, Array], distance: float, size_m: float) -> Array:
    """Return the centre of a limb at a distance from its root through the body, (3,), metres.

    Args:
        region: voxels of the limb, (n, 3).
        lengths: their distances, (n,), metres.
        begin: root of the limb, the distance at which it stands out, and its centre there.
        distance: the distance, metres.
        size_m: edge of a voxel, metres.
    """
    root, hidden_m, first = begin
    if distance <= hidden_m:
        return np.asarray(root + (first - root) * distance / hidden_m)
    gaps = np.abs(lengths - distance)
    return np.asarray(region[gaps <= max(size_m, float(gaps.min()))].mean(axis=0))
