"""Find the limbs of a figure as connected regions beside the torso, and divide them (MTHC01 Sect. 3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.initialization.generators.torso_template import Torso
from tracker.evidence.voxels.paths import VoxelGraph, path_lengths
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array, IntArray

_SKIN_M = 0.11
"""Voxels that are closer to the torso through the body belong to its skin, which would connect the limbs, metres."""
_MIN_LIMB_M = 0.25
"""Smallest distance of a limb's end from its beginning, metres."""
_MIN_VOXELS = 0.01
"""Smallest share of a figure's voxels in a limb."""
_MIN_REACH_M = 0.12
"""Smallest length of a branch beyond a fork, metres."""
_LEG_M = 0.30
"""A limb whose tip is farther than this below the trunk is a leg, metres."""
_LEG_ROOT = -0.75
"""A limb that begins lower on the trunk, as a share of half its length from its middle, is a leg, raised or not."""
_SLICE_M = 0.03
"""Half the thickness of the slice whose mean is a limb's centre, metres."""


class _Division(NamedTuple):
    """Places of the joints of a limb along it."""

    middle: float
    """Elbow or knee, as a share of the length through the limb to wrist or ankle, bent or not."""
    end_m: float
    """Distance of the wrist or ankle from the end of the limb, metres."""


_DIVISIONS = {"arm": _Division(0.53, 0.10), "leg": _Division(0.52, 0.12)}
"""P. de Leva 1996 (J. Biomech. 29:1223) has elbow and knee at 0.51 and 0.49 from shoulder and hip, but the region
begins at the trunk's surface. With these the heavy and the tall thin man of `tests/benchmarks/from_nothing.py` ended at
26 and 32 mm, not at 20 and 15."""


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
    points = figure.points_world
    distances = path_lengths(graph, torso.is_torso | is_head, figure.grid.size_m)
    whole = np.flatnonzero(np.isfinite(distances) & (distances > _SKIN_M))
    found = [_limb(points, branch, distances, torso) for branch in _branches(figure, whole, distances, _SKIN_M)]
    return sorted(found, key=lambda limb: -len(limb.indices))


class _Branch(NamedTuple):
    own: IntArray
    """Its voxels, indices into those of the figure, (n,)."""
    begins_m: float
    """Distance from the torso at which it stands out."""


def _branches(figure: Voxels, own: IntArray, distances: Array, begins_m: float) -> list[_Branch]:
    """Return the connected regions of voxels beyond a distance, divided where they fork farther out."""
    size_m, n_least = figure.grid.size_m, _MIN_VOXELS * len(figure.indices)
    level = begins_m
    while True:
        beyond = own[distances[own] > level]
        regions = [
            r for r in _connected(figure, beyond) if len(r) >= n_least and distances[r].max() - level >= _MIN_REACH_M
        ]
        if not regions:
            enough = len(own) >= n_least and distances[own].max() - begins_m >= _MIN_LIMB_M if len(own) else False
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


def _limb(points: Array, branch: _Branch, distances: Array, torso: Torso) -> LimbRegion:
    """Return the limb of a branch. Its hidden first stretch is assumed straight."""
    region, from_torso, half = points[branch.own], distances[branch.own], torso.half_axes[2]
    # Voxels of a child who is enlarged to an adult are wide: there may be none this near.
    first = region[from_torso <= max(branch.begins_m + 0.05, from_torso.min())].mean(axis=0)
    tip = region[from_torso > from_torso.max() - 0.04].mean(axis=0)
    (begins_z, tip_z) = torso.local(np.stack([first, tip]))[:, 2]
    own_root = branch.begins_m < _SKIN_M + 0.05
    kind = "leg" if tip_z < -half - _LEG_M or (own_root and begins_z < _LEG_ROOT * half) else "arm"
    length = from_torso.max() - _DIVISIONS[kind].end_m
    side = np.sign(torso.local(first[None])[0, 1]) or 1.0
    across, along = (0.35, -0.75) if kind == "leg" else (1.0, 0.85)
    root = torso.center + torso.axes @ np.array([0.0, side * across * max(0.12, torso.half_axes[1]), along * half])
    shares = (_DIVISIONS[kind].middle, 1.0)
    middle, distal = (_at(region, from_torso, (root, branch.begins_m, first), s * length) for s in shares)
    return LimbRegion(kind, root, middle, distal, branch.own)


def _at(region: Array, from_torso: Array, begin: tuple[Array, float, Array], distance: float) -> Array:
    """Return the centre of a limb at a distance from the torso through the body, (3,), metres.

    Args:
        region: voxels of the limb, (n, 3).
        from_torso: their distances, (n,), metres.
        begin: root of the limb, the distance at which it stands out, and its centre there.
        distance: the distance, metres.
    """
    root, begins_m, first = begin
    if distance <= begins_m:
        return np.asarray(root + (first - root) * max(0.0, distance) / begins_m)
    gaps = np.abs(from_torso - distance)
    return np.asarray(region[gaps <= max(_SLICE_M, float(gaps.min()))].mean(axis=0))
