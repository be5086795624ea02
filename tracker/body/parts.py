"""The schema of a body: joints, the parts that they carry, and named points on the parts."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tracker.geometry.shapes import Ellipsoid, EllipticalCone, Shape, TaperedSuperquadric


@dataclass(frozen=True)
class Axis:
    """One rotation of a revolute joint."""

    name: str
    """Name of the degree of freedom within its joint, e.g. `abduction`."""
    direction: tuple[float, float, float]
    """Unit axis in the joint's frame, after the rotations listed before it."""
    limits: tuple[float, float]
    """Lowest and highest angle, rad; infinite for an unlimited angle."""
    spread: float = np.inf
    """Standard deviation of people's angles from 0, rad; infinite if unknown. The prior keeps a degree of freedom near
    0 that the image hardly shows, such as the bending of a trunk."""


@dataclass(frozen=True)
class Joint:
    """The joint that moves a part relative to its parent."""

    name: str
    parent: str
    """Name of the parent part; empty for the root."""
    child: str
    """Name of the part that the joint moves; its frame sits at the joint."""
    position: tuple[float, float, float]
    """Position of the joint in the parent's frame, fraction of body height."""
    kind: Literal["revolute", "ball"]
    axes: tuple[Axis, ...]
    """Rotations in order for a revolute joint; none makes it rigid. Empty for a ball joint."""
    free: bool = False
    """Whether the joint also translates along world x, y, z before it rotates (the root)."""
    cone: float = np.pi
    """Ball joints: largest tilt of the child's z axis from the parent's, rad."""
    twist: float = np.pi
    """Ball joints: largest rotation about the child's z axis either way, rad."""
    center_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """From the pivot to the anatomical joint centre in the parent's frame (the root's own), fraction of body height."""
    center_source: str = ""
    """Source of this offset; empty without one."""

    @property
    def dof_names(self) -> tuple[str, ...]:
        """Names of the joint's degrees of freedom, translations first."""
        rotations = tuple(a.name for a in self.axes) if self.kind == "revolute" else ("rx", "ry", "rz")
        return tuple(f"{self.name}.{n}" for n in (("x", "y", "z") if self.free else ()) + rotations)


@dataclass(frozen=True)
class Part:
    """A rigid piece of the body: a shape in the frame of a part, all lengths as fractions of body height."""

    name: str
    half_axes: tuple[float, float, float]
    """Half-axes of the shape along its x, y, z, fraction of body height."""
    exponents: tuple[float, float]
    """e1, e2 of a tapered superquadric; 1, 1 for other kinds."""
    taper: tuple[float, float]
    """k_x, k_y of a tapered superquadric; k, k of a cone; 0, 0 of an ellipsoid."""
    center: tuple[float, float, float]
    """Centre of the shape in the part's frame, fraction of body height."""
    color: str
    """Colour in which the part is drawn, `#rrggbb`."""
    kind: Literal["superquadric", "cone", "ellipsoid"] = "superquadric"
    """Family of the shape."""

    def shape(self, height_m: float) -> Shape:
        """Return the shape at a body height, metres."""
        a1, a2, a3 = self.half_axes
        half_axes = (a1 * height_m, a2 * height_m, a3 * height_m)
        if self.kind == "cone":
            return EllipticalCone(half_axes, self.taper[0])
        if self.kind == "ellipsoid":
            return Ellipsoid(half_axes)
        return TaperedSuperquadric(half_axes, self.exponents, self.taper)


@dataclass(frozen=True)
class Landmark:
    """A named point of the body that is not a joint of the tree (a wrist, an ankle, the head)."""

    name: str
    part: str
    position: tuple[float, float, float]
    """Position in the part's frame, fraction of body height."""
    center_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """From this position to the anatomical joint centre in the part's frame, fraction of body height."""
    center_source: str = ""
    """Source of this offset; empty without one."""


@dataclass(frozen=True)
class SearchGroup:
    """A leaf of the decomposition of the pose space (GD96 Eq. 5-7)."""

    name: str
    dofs: tuple[str, ...]
    """Names of the degrees of freedom searched together."""
