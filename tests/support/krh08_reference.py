"""The formulas of Knossow, Ronfard & Horaud 2008 in double precision: the reference of kinematics and contour kernels.

The paper's misprints are corrected. Twists are spatial throughout: V is the velocity of the point at the world's
origin. The normal of a cone is alpha' x beta, which does not vanish for a cylinder. The roots of Eq. 13 come from atan2
and acos, which lose none.
"""

from typing import NamedTuple

import numpy as np

from tracker.geometry import rigid

J_TILDE = np.zeros((4, 4))
J_TILDE[0, 1], J_TILDE[1, 0] = -1.0, 1.0
"""Tangent of the canonical rotation J, about z (before Eq. 45)."""
SINGULAR = 0.02
"""Conditioning of a ruling below which it is flagged: the line of sight is within about a degree of its neighbours'."""


# --- Zero-reference kinematics, Eq. 33-45 and 48-54 ---


class Joint(NamedTuple):
    """One rotational degree of freedom of a chain."""

    dof: int
    U: np.ndarray
    """U_i of Eq. 40, at the docking pose, (4, 4)."""


class ZeroReference:
    """The zero-reference model of a body of revolute joints: fixed U_i and docking poses of all parts."""

    def __init__(self, model, docking):
        """`docking` is Psi0: the root's values at which all U_i are taken, the joint angles being zero (Eq. 41)."""
        self.model, self.docking = model, np.asarray(docking, float)
        n_root = len(model.joints[0].dof_names)
        self.D0 = root_motion(model, self.docking)
        self.chains, self.docked, dof = [], [], n_root  # of each part: its joints, and its pose at the docking
        for part, joint in enumerate(model.joints):
            if part == 0:
                self.chains.append(())
                self.docked.append(self.D0)
                continue
            parent = model.parents[part]
            L = self.docked[parent] @ rigid.transform(t=np.array(joint.position) * model.height_m)
            own = []
            for axis in joint.axes:  # L_i turns z to the axis and back; with zero angles nothing else changes
                own.append(Joint(dof, L @ rigid.transform(R=turn_to(np.array(axis.direction)))))
                dof += 1
            self.chains.append(self.chains[parent] + tuple(own))
            self.docked.append(L)

    def H(self, values, part):
        """H of Eq. 42: F(Psi, Psi0) Q1 .. Qp, (4, 4)."""
        out = root_motion(self.model, values) @ rigid.inverse(self.D0)  # F, Eq. 36
        for joint in self.chains[part]:
            out = out @ Q(joint.U, values[joint.dof])
        return out

    def part_poses(self, values):
        """Poses of all parts, (n_parts, 4, 4): H applied to where the docking puts them (Eq. 34)."""
        return np.array([self.H(values, p) @ T for p, T in enumerate(self.docked)])

    def J_H(self, values, part):
        """Jacobian of the kinematic chain, Eq. 54 with spatial twists: (6, n_dofs), rotational velocity first."""
        out = np.zeros((6, self.model.n_dofs))
        out[:, : len(self.model.joints[0].dof_names)] = root_twists(self.model, values)
        before = root_motion(self.model, values) @ rigid.inverse(self.D0)
        for joint in self.chains[part]:  # F Q1 .. Qi-1 Q~i (..)^-1, Eq. 48 and 52
            tangent = before @ joint.U @ J_TILDE @ rigid.inverse(joint.U) @ rigid.inverse(before)
            out[:, joint.dof] = tangent[2, 1], tangent[0, 2], tangent[1, 0], *tangent[:3, 3]
            before = before @ Q(joint.U, values[joint.dof])
        return out


def Q(U, angle):
    """Q_i of Eq. 40 with zero reference angles, (4, 4)."""
    return U @ rigid.transform(R=rigid.so3_exp(np.array([0.0, 0.0, angle]))) @ rigid.inverse(U)


def turn_to(direction):
    """A rotation that takes z to a unit direction, (3, 3)."""
    x = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x), direction], axis=1)


def root_motion(model, values):
    """D(Psi): the free motion of the root, (4, 4). The order of its rotations is the model's."""
    out = rigid.transform(t=np.array(values[:3], float))
    for axis, angle in zip(model.joints[0].axes, values[3:6], strict=True):
        out = out @ rigid.transform(R=rigid.so3_exp(angle * np.array(axis.direction)))
    return out


def root_twists(model, values):
    """The root's block of Eq. 51 and 54, (6, 6): t x omega stands below each rotation, as spatial twists need."""
    t, R, out = np.array(values[:3], float), np.eye(3), np.zeros((6, 6))
    out[3:, :3] = np.eye(3)
    for k, (axis, angle) in enumerate(zip(model.joints[0].axes, values[3:6], strict=True)):
        omega = R @ np.array(axis.direction)
        out[:, 3 + k] = *omega, *np.cross(t, omega)
        R = R @ rigid.so3_exp(angle * np.array(axis.direction))
    return out


# --- Contour generators and their motion, Eq. 3-31 ---


class Cone(NamedTuple):
    """A truncated elliptical cone in its own frame (Eq. 12)."""

    a: float
    b: float
    k: float

    @classmethod
    def of(cls, shape):
        """From half-axes and relative taper."""
        a1, a2, a3 = shape.half_axes
        return cls(a1, a2, shape.taper / a3)

    def point(self, theta, z):
        """X(theta, z), Eq. 12."""
        c, s, w = np.cos(theta), np.sin(theta), 1 + self.k * z
        return np.array([self.a * c * w, self.b * s * w, z])

    def by_theta(self, theta, z):
        """X_theta."""
        w = 1 + self.k * z
        return np.array([-self.a * np.sin(theta) * w, self.b * np.cos(theta) * w, 0.0])

    def ruling(self, theta):
        """beta(theta), Eq. 8."""
        return np.array([self.a * self.k * np.cos(theta), self.b * self.k * np.sin(theta), 1.0])

    def normal(self, theta):
        """alpha' x beta, the direction of Eq. 9, which also serves a cylinder."""
        c, s = np.cos(theta), np.sin(theta)
        return np.array([self.b * c, self.a * s, -self.a * self.b * self.k])

    def normal_by_theta(self, theta):
        """n_theta."""
        return np.array([-self.b * np.sin(theta), self.a * np.cos(theta), 0.0])

    def rulings(self, m):
        """Solve F cos(theta) + G sin(theta) + H = 0 (Eq. 11, 13), with m = R^T (t - C).

        Returns:
            Two angles, or none where the eye is inside the cone or its extension.
        """
        # (alpha + m) . n with alpha = (a cos, b sin, 0) and n as in `normal`.
        F, G = m[0] * self.b, m[1] * self.a
        H = self.a * self.b * (1 - self.k * m[2])
        radius = np.hypot(F, G)
        if radius <= abs(H):
            return ()
        middle, half = np.arctan2(G, F), np.arccos(-H / radius)
        return middle - half, middle + half


class Ruling(NamedTuple):
    """One point of a contour generator, and how it moves."""

    point_world: np.ndarray
    x: np.ndarray
    """Image of the point, (2,), px."""
    normal_px: np.ndarray
    """Unit normal of the extremal contour in the image, (2,)."""
    J_I: np.ndarray
    """Image Jacobian, Eq. 16 with the camera's pose and intrinsics, (2, 3)."""
    A: np.ndarray
    """Rigid motion by the spatial twist, [-[X]x I], (3, 6)."""
    B: np.ndarray
    """Sliding motion by the spatial twist, Eq. 31, (3, 6); downweighted where it is flagged."""
    conditioning: float
    """|b| of Eq. 31 relative to its factors: the sine of the angle between line of sight and neighbouring tangents."""

    @property
    def singular(self):
        """Whether the ruling is nearly where the two rulings of a cone meet: its sliding speed has no bound there."""
        return self.conditioning < SINGULAR


def ruling(cone, T_world_cone, camera, theta, z):
    """The point of a contour generator at z, and its Jacobians. `theta` is one of `Cone.rulings`."""
    R, t, C = T_world_cone[:3, :3], T_world_cone[:3, 3], camera.center_world
    X = cone.point(theta, z)
    world = R @ X + t
    J_I = image_jacobian(camera, world)
    n, by_theta, n_theta = R @ cone.normal(theta), R @ cone.by_theta(theta, z), cone.normal_by_theta(theta)
    sight = X + R.T @ (t - C)
    b = sight @ n_theta  # Eq. 31
    scale = np.linalg.norm(sight) * np.linalg.norm(n_theta)
    conditioning = abs(b) / scale
    # 1/b without its pole: exact where it is well conditioned, and 0 where the rulings meet.
    inverse = 1 / b if conditioning >= SINGULAR else b / (SINGULAR * scale) ** 2
    B = inverse * np.outer(by_theta, np.concatenate([n @ rigid.skew(C), -n]))
    along = J_I @ R @ cone.ruling(theta)
    along /= np.linalg.norm(along)
    A = np.hstack([-rigid.skew(world), np.eye(3)])
    return Ruling(world, project(camera, world), np.array([-along[1], along[0]]), J_I, A, B, conditioning)


def project(camera, world):
    """Image of a point, (2,), px."""
    h = camera.projection @ np.append(world, 1.0)
    return h[:2] / h[2]


def image_jacobian(camera, world):
    """J_I of Eq. 16, of a camera that has a pose and intrinsics, (2, 3)."""
    P = camera.projection
    h = P @ np.append(world, 1.0)
    return (P[:2, :3] - np.outer(h[:2] / h[2], P[2, :3])) / h[2]


# --- The chamfer image, Eq. 59 ---


def distance(image, x):
    """Bilinear distance and its gradient; the paper's second component is misprinted (x is column, row)."""
    u, v = int(x[0]), int(x[1])
    r1, r2 = x[0] - u, x[1] - v
    C00, C10, C01, C11 = image[v, u], image[v, u + 1], image[v + 1, u], image[v + 1, u + 1]
    D = (1 - r1) * (1 - r2) * C00 + r1 * (1 - r2) * C10 + (1 - r1) * r2 * C01 + r1 * r2 * C11
    gradient = (1 - r2) * (C10 - C00) + r2 * (C11 - C01), (1 - r1) * (C01 - C00) + r1 * (C11 - C10)
    return D, np.array(gradient)
