"""Sizes of a body that stands straight. Those of a typical adult measure figures of voxels; children are enlarged."""

from functools import cached_property, lru_cache

import numpy as np

from tracker.body.limbs import display_name, limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.estimation.acquisition.size_parameters import typical_body
from tracker.estimation.initialization.generators.limb_poses import trunk_parts
from tracker.evidence.voxels.voxel_grid import VOXEL_M, VoxelGrid, Voxels
from tracker.formats.model_toml import DEFAULT_HEIGHT_M, load_model
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray

SIDES = ("left", "right")
_JOINTS = {"arm": ("shoulder", "elbow", "wrist"), "leg": ("hip", "knee", "ankle")}
WITH_HANDS, ROUNDED = "knossow54", "gavrila38"
"""Built-in bodies: one of cones with hands and a neck, and one with a rounded head."""


@lru_cache(maxsize=16)
def typical_person(scale: float = 1.0, preset: str = WITH_HANDS) -> "StandingBody":
    """Return a built-in body of typical proportions whose height is a share of an adult's."""
    return StandingBody(typical_body(load_model(preset, scale * DEFAULT_HEIGHT_M)))


class StandingBody:
    """A body that stands straight with hanging arms: x forwards, y to the left, z up, metres."""

    def __init__(self, model: BodyModel) -> None:
        self._model, self._joints, head = model, model.named_points_world(model.neutral()), model.part_index["head"]
        self.figure, self._parts = _voxels(model)
        """Its voxels, and the part of each, (N,)."""
        points, half = self.figure.points_world, model.shapes[head].half_axes
        self.crown_m, sole_m = float(points[:, 2].max()) + VOXEL_M / 2, float(points[:, 2].min()) - VOXEL_M / 2
        """Height of the crown."""
        self.height_m, self.half_breadth_m = self.crown_m - sole_m, float(points[:, 1].max()) + VOXEL_M / 2
        """Distance of crown and soles, and half the breadth over both arms."""
        self.head_radius_m, self.head_m = float(max(half)), 2 * float(max(half))
        """Half the largest dimension of the head, and all of it."""
        self.neck_m = float(np.linalg.norm(points[self._parts == head].mean(axis=0) - self._joints["neck"]))
        """Distance of the joint of the neck from the centre of the head."""

    def from_neck(self, joint: str) -> Array:
        """Return the place of a joint from the base of the neck, (3,)."""
        return np.asarray(self._joints[joint] - self._joints["neck"])

    def below_crown_m(self, joint: str) -> float:
        """Return the depth of a joint below the crown."""
        return self.crown_m - float(self._joints[joint][2])

    def segments_m(self, kind: str) -> Array:
        """Return the lengths of the segments of an `arm` or `leg`, the last one to its tip, (3,)."""
        joints = np.array([self._joints[f"left_{j}"] for j in _JOINTS[kind]])
        limb = self.figure.points_world[np.isin(self._parts, self._limb(f"left_{kind}"))]
        tips = np.linalg.norm(limb - joints[-1], axis=1)[limb[:, 2] < joints[-1, 2]]
        return np.append(np.linalg.norm(np.diff(joints, axis=0), axis=1), tips.max() + VOXEL_M / 2)

    def share_of(self, kind: str) -> float:
        """Return the share of the body's volume in one `arm` or `leg`."""
        return float(np.isin(self._parts, self._limb(f"left_{kind}")).mean())

    def thickness_m(self, kind: str) -> float:
        """Return the thickness of the first part of an `arm` or `leg`."""
        name = {"arm": "left_upper_arm", "leg": "left_thigh"}[kind]
        return 2 * float(self._model.shapes[self._model.part_index[name]].half_axes[0])

    @property
    def half_trunk_m(self) -> Array:
        """Half the depth and half the width of the trunk without arms, (2,)."""
        return np.array(self._model.shapes[self._model.part_index["torso"]].half_axes[:2])

    @cached_property
    def profile(self) -> tuple[Array, Array]:
        """Depths below the crown, (n,), and widths of head and trunk without arms there, the mean of all sides."""
        points = self.figure.points_world[np.isin(self._parts, trunk_parts(self._model))]
        turns = np.arange(12) * np.pi / 12
        across = points[:, :2] @ np.array([np.cos(turns), np.sin(turns)])
        heights = np.unique(points[:, 2])[::-1]
        widths = [np.ptp(across[points[:, 2] == z], axis=0).mean() + VOXEL_M for z in heights]
        return self.crown_m - heights, np.array(widths)

    def _limb(self, name: str) -> IntArray:
        """Return the parts of a limb, such as `left_arm`."""
        return next(limb.parts for limb in limbs(self._model) if limb_display_name(limb.name) == display_name(name))


def _voxels(model: BodyModel) -> tuple[Voxels, IntArray]:
    """Return the voxels of a body in its default pose, and the part of each, (N,)."""
    solids = [*zip(model.shapes, model.centers_part, model.kinematics(model.neutral()).Ts_world_part, strict=True)]
    surface = np.concatenate([rigid.apply(T, shape.triangles().vertices + center) for shape, center, T in solids])
    grid = VoxelGrid.over(surface.min(axis=0), surface.max(axis=0), VOXEL_M)
    points = grid.centers(np.argwhere(np.ones(grid.shape, bool)))
    values = [shape.inside_outside(rigid.apply(rigid.inverse(T), points) - center) for shape, center, T in solids]
    is_in = np.min(values, axis=0) <= 1
    return Voxels(grid, is_in.reshape(grid.shape)), np.argmin(values, axis=0)[is_in]
