"""A smooth-skinned person: a surface blended from lobes, deformed by its bones, dressed and painted."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.surface_nets import surface_nets
from tracker.simulate.people.anatomy import Lobe, bone_names, bone_poses
from tracker.simulate.people.builds import MAN, Build
from tracker.simulate.people.outfit import Outfit

SPACING_M = 0.010
"""Spacing of the implicit surface's grid: about a pixel at four metres."""
BLEND_M = 0.011
"""Width over which lobes blend."""
WEIGHT_STEPS = 40
"""Diffusion steps of the skinning weights: a joint deforms some 5 cm of skin."""
REST_DEGREES = {"shoulder.abduction": 55.0, "elbow.extension": 15.0, "hip.abduction": 9.0, "knee.extension": 5.0}
"""Pose in which the surface is made: limbs apart, so that they do not blend, and joints half bent."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A mesh with skinning weights, made once in a rest pose."""

    model: BodyModel
    """Skeleton."""
    outfit: Outfit
    """Clothes and colours."""
    vertices_rest: Array
    """Vertices in the rest pose, (N, 3), metres, world."""
    faces: IntArray
    """Triangles, counter-clockwise seen from outside, (M, 3)."""
    weights: Array
    """Weight of each bone for each vertex, (N, n_bones); rows sum to 1."""

    @cached_property
    def bone_poses_rest(self) -> Array:
        """`Ts_world_bone` of the rest pose, (n_bones, 4, 4)."""
        return bone_poses(self.model, rest_values(self.model))

    @cached_property
    def face_bones(self) -> IntArray:
        """Index of the bone that each triangle follows most, (M,)."""
        return np.argmax(self.weights[self.faces].sum(axis=1), axis=1)

    @cached_property
    def _bone_parents(self) -> list[int]:
        calves = [self.model.part_index["left_calf"], self.model.part_index["right_calf"]]
        return [*self.model.parents, *calves]

    def posed(self, values: Array) -> Array:
        """Return the vertices in a pose, (N, 3), metres, world, by dual-quaternion skinning (L. Kavan et al. 2007)."""
        Ts = bone_poses(self.model, values) @ rigid.inverse(self.bone_poses_rest)
        real = rigid.quaternion_from_matrix(Ts[:, :3, :3])
        for bone, parent in enumerate(self._bone_parents):
            # q and -q are the same rotation, but not in a blend: use the one nearer to the parent's.
            if parent >= 0 and real[bone] @ real[parent] < 0:
                real[bone] = -real[bone]
        dual = 0.5 * rigid.quaternion_multiply(np.pad(Ts[:, :3, 3], ((0, 0), (1, 0))), real)
        real, dual = self.weights @ real, self.weights @ dual
        norms = np.linalg.norm(real, axis=1, keepdims=True)
        conjugate = real * (1.0, -1.0, -1.0, -1.0) / norms
        t = 2.0 * rigid.quaternion_multiply(dual / norms, conjugate)[:, 1:]
        w, v = real[:, :1] / norms, real[:, 1:] / norms
        p = self.vertices_rest
        return p + 2.0 * np.cross(v, np.cross(v, p) + w * p) + t

    def colors(self, faces: IntArray, corner_weights: Array) -> Array:
        """Return colours, (n, 3), 0 to 1, at points on triangles `(n,)` with barycentric weights `(n, 3)`."""
        points_rest = np.einsum("nk,nkc->nc", corner_weights, self.vertices_rest[self.faces[faces]])
        Ts_bone_rest = rigid.inverse(self.bone_poses_rest)
        height = self.model.height_m
        bones = self.face_bones[faces]
        T = Ts_bone_rest[bones]
        points_bone = np.einsum("nij,nj->ni", T[:, :3, :3], points_rest) + T[:, :3, 3]
        points_torso = rigid.apply(Ts_bone_rest[self.model.part_index["torso"]], points_rest)
        names = np.array(bone_names(self.model))[bones]
        return self.outfit.colors(names, points_bone / height, points_torso / height)


def make_skin(model: BodyModel, outfit: Outfit, build: Build = MAN) -> Skin:
    """Make the skin of a body: blend its lobes, mesh the surface, compute skinning weights."""
    flesh = build.flesh(model)
    Ts_rest = bone_poses(model, rest_values(model))
    names = bone_names(model)
    Ts_lobe = [Ts_rest[names.index(lobe.bone)] for lobe in flesh]
    field, origin = _blended_field(flesh, Ts_lobe, model.height_m)
    vertices, faces = surface_nets(field, origin, SPACING_M)
    distances = [_lobe_distances(lobe, T, model.height_m, vertices) for lobe, T in zip(flesh, Ts_lobe, strict=True)]
    nearest = np.argmin(distances, axis=0)
    bones = np.array([names.index(lobe.bone) for lobe in flesh])[nearest]
    return Skin(model, outfit, vertices, faces, _diffused(np.eye(len(names))[bones], faces))


def rest_values(model: BodyModel) -> Array:
    """Return the pose in which the skin is made."""
    values = model.neutral()
    for i, name in enumerate(model.value_names):
        values[i] += np.radians(REST_DEGREES.get(name.removeprefix("left_").removeprefix("right_"), 0.0))
    return values


def _lobe_distances(lobe: Lobe, T_world_bone: Array, height: float, points_world: Array) -> Array:
    """Return signed distances of points (..., 3) from a lobe, accurate near the surface, metres."""
    squash = np.array(lobe.squash)
    points = rigid.apply(rigid.inverse(T_world_bone), points_world) / (height * squash)
    start, end = np.array(lobe.start) / squash, np.array(lobe.end) / squash
    axis = end - start
    along = np.clip((points - start) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
    radii = lobe.radii[0] + along * (lobe.radii[1] - lobe.radii[0])
    distances = np.linalg.norm(points - start - along[..., None] * axis, axis=-1) - radii
    return distances * height * float(np.mean(squash))


def _blended_field(flesh: list[Lobe], Ts_lobe: list[Array], height: float) -> tuple[NDArray[np.float32], Array]:
    """Return the smooth union `-k log sum exp(-d / k)` of the lobes on a grid, and the grid's origin."""
    boxes = []
    for lobe, T in zip(flesh, Ts_lobe, strict=True):
        ends = rigid.apply(T, np.array([lobe.start, lobe.end]) * height)
        margin = max(lobe.radii) * height + 6.0 * BLEND_M
        boxes.append((ends.min(axis=0) - margin, ends.max(axis=0) + margin))
    origin = np.min([low for low, _ in boxes], axis=0)
    shape = np.ceil((np.max([high for _, high in boxes], axis=0) - origin) / SPACING_M).astype(int) + 1
    total = np.full(shape, np.exp(-6.0), dtype=np.float32)
    for lobe, T, (low, high) in zip(flesh, Ts_lobe, boxes, strict=True):
        first = np.floor((low - origin) / SPACING_M).astype(int)
        last = np.ceil((high - origin) / SPACING_M).astype(int) + 1
        axes = [origin[i] + SPACING_M * np.arange(first[i], min(last[i], shape[i])) for i in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        window = tuple(slice(first[i], first[i] + len(axes[i])) for i in range(3))
        total[window] += np.exp(-_lobe_distances(lobe, T, height, points) / BLEND_M).astype(np.float32)
    return np.asarray(-BLEND_M * np.log(total), dtype=np.float32), origin


def _diffused(weights: Array, faces: IntArray) -> Array:
    """Diffuse weights along the surface: from bone to bone, but not from limb to limb."""
    n = len(weights)
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    adjacency = sparse.csr_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(n, n))
    adjacency = sparse.csr_array(adjacency / adjacency.sum(axis=1)[:, None])
    for _ in range(WEIGHT_STEPS):
        weights = 0.5 * (weights + adjacency @ weights)
    return weights / weights.sum(axis=1, keepdims=True)
