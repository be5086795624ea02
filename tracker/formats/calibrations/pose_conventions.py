"""Test which convention the poses of a calibration follow, by where the cameras would look and stand.

The numbers of a pose are a rotation and a vector, which programs use in different ways. Each passes every check of a
single camera. Of a whole rig, only the right one lets cameras that film one scene look at one place with their pictures
level: the others turn the axes apart, let the cameras look away, or put all at one place.

Ambiguous rotations are resolved likewise. Four numbers are a quaternion with its real part first or last. Three numbers
are a rotation vector or angles about the axes. Rotations that are all equal are parallel cameras or were never filled
in.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError, Remedy
from tracker.formats.calibrations.camera_matrices import plain_array, rotation_of_quaternion
from tracker.formats.calibrations.camera_words import Section
from tracker.formats.calibrations.convention_names import CONVENTIONS, PoseConvention
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.camera_rig import axes_point
from tracker.geometry.rigid import so3_exp
from tracker.validation import ROUNDING, quoted

STATED: PoseConvention = "world-to-camera"
_MEANING = {
    "world-to-camera": "X_camera = R X_world + t",
    "camera-to-world": "X_world = R X_camera + t",
    "row-vectors": "X_camera = R^T X_world + t, as MATLAB writes it",
    "camera-position": "R maps world to camera, and t is the place of the camera",
}
_REWRITE = {
    "world-to-camera": "keep R and t",
    "camera-to-world": "invert them: R' = R^T, t' = -R^T t",
    "row-vectors": "transpose R alone: R' = R^T, t' = t",
    "camera-position": "replace t alone: t' = -R t",
}
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""From a camera's axes in OpenGL (y up, z backwards) to OpenCV's."""

# Degrees; measured on simulated rigs of 2 to 8 cameras in rings, arcs, corners and rows, aimed up to 12 degrees beside
# one point, level or turned by 90 degrees: tests/tracker/formats/calibrations/test_pose_conventions.py.
FITS_DEG = 30.0
"""Cost up to which a convention fits, and angle up to which a camera looks at a point, degrees: half a usual lens.
Checked, as all here, on rigs of test_pose_conventions.py."""


class _Lead(NamedTuple):
    """A convention is doubted if it costs more than a number of times another, and a number of degrees more."""

    ratio: float
    """Number of times."""
    margin: float
    """Degrees."""


_LEAD = _Lead(1.3, 5.0)
"""Of three cameras or more."""
_LEAD_OF_PAIR = _Lead(2.0, 20.0)
"""Of two cameras, whose axes meet by chance more often."""
_MAX_ANGLE = 60.0
"""Largest cost of an axis, degrees: what points elsewhere counts alike. Also the cost of axes that are all parallel:
the cameras may look at one place, but nothing shows it."""
LOOK_DOWN = 0.3
"""Part of the vertical in the picture below which a camera that looks down has no level (17 degrees)."""
_UNKNOWN_ROLL = 22.5
"""Cost of a roll that is not known, degrees: the mean of all."""
_MAX_COMPARED = 24
"""Most cameras that are compared in pairs, which bounds time; of more, some are chosen evenly."""


def read_pose(T_stated: Array, convention: PoseConvention) -> Array:
    """Return the pose of a camera, world to camera, that a convention reads from a stated one, both (4, 4)."""
    R, t = T_stated[:3, :3], T_stated[:3, 3]
    kind = convention.removesuffix("-opengl")
    if kind == "camera-to-world":
        T = rigid.inverse(T_stated)
    elif kind == "row-vectors":
        T = rigid.transform(R.T, t)
    elif kind == "camera-position":
        T = rigid.transform(R, -R @ t)
    else:
        T = T_stated
    return OPENGL @ T if convention.endswith("-opengl") else T


def costs(Ts_stated: Sequence[Array]) -> dict[PoseConvention, float]:
    """Return how badly each convention fits, degrees.

    Args:
        Ts_stated: stated poses of at least two cameras, (4, 4), in any unit.

    Returns:
        The root mean square angle between the axes and the point that all see, plus that between the sides of the
        pictures and the vertical that levels them best; turns by 90 degrees count as level.
    """
    chosen = spread_indices(len(Ts_stated), _MAX_COMPARED)
    return {c: _cost([rigid.inverse(read_pose(Ts_stated[i], c)) for i in chosen]) for c in CONVENTIONS}


def _cost(Ts_world_camera: Sequence[Array]) -> float:
    point = axes_point(Ts_world_camera)
    look = _MAX_ANGLE
    if point.is_determined:
        look = float(np.sqrt(np.mean(np.minimum(np.degrees(point.angles_rad), _MAX_ANGLE) ** 2)))
    return look + _roll(np.asarray(Ts_world_camera))


def _roll(Ts_world_camera: Array) -> float:
    """Return the root mean square roll of the pictures against the vertical that levels them best, degrees."""
    x, y = Ts_world_camera[:, :3, 0], Ts_world_camera[:, :3, 1]
    sides = np.concatenate([x, y])
    pairs = np.array([(i, j) for i, j in combinations(range(len(sides)), 2) if (j - i) % len(x)])
    # A vertical that is level in two pictures is across one side of each, or along a side that they share.
    normals = np.cross(sides[pairs[:, 0]], sides[pairs[:, 1]])
    lengths = np.linalg.norm(normals, axis=1)
    verticals = np.concatenate([normals[lengths > 0.1] / lengths[lengths > 0.1, None], sides])
    across, along = verticals @ x.T, verticals @ y.T
    rolls = np.abs((np.degrees(np.arctan2(across, along)) + 45) % 90 - 45)
    rolls = np.where(np.hypot(across, along) < LOOK_DOWN, _UNKNOWN_ROLL, rolls)
    return float(np.sqrt(np.mean(rolls**2, axis=1)).min())


def check_convention(
    Ts_stated: Sequence[Array], where: str, expected: str, is_fixed: bool, is_turned: bool = False
) -> str | None:
    """Check that the stated convention fits: poses that map world to camera, with OpenCV's axes.

    Args:
        Ts_stated: stated poses, (4, 4), in any unit.
        where: names the file in messages.
        expected: names the convention in which the file's poses were read, for messages.
        is_fixed: whether the layout of the file fixes the convention.
        is_turned: whether that convention is another, from which the poses were turned to the stated ones.

    Returns:
        A note, if another convention fits as well and the layout fixes none; None otherwise.

    Raises:
        CalibrationError: another convention fits, and this one does not.
    """
    if len(Ts_stated) < 2:
        return None
    cost = costs(Ts_stated)
    stated = cost.pop(STATED)
    best = min(cost.values())
    others = _distinct(
        [c for c in cost if cost[c] <= min(FITS_DEG, max(_LEAD.ratio * best, best + _LEAD.margin))], Ts_stated
    )
    if is_clearly_worse(stated, best, len(Ts_stated)):
        rewrite = _rewrite(others[0])
        condition = f"if R and t, as read, are changed ({rewrite})" if is_turned else f"if {in_words(others[0])}"
        misfit = f"{expected}, by which the cameras see no one place"
        if len(others) == 1:
            remedy = Remedy("give_poses", poses=others[0], rewrite="likewise" if is_turned else rewrite)
            raise CalibrationError.mismatch(where, misfit, f"that they do {condition}", remedy)
        fitting = "; ".join(f"{c} ({in_words(c)})" for c in others)
        raise CalibrationError.mismatch(where, misfit, f"that several others fit: {fitting}", Remedy("choose_poses"))
    others = [c for c in others if cost[c] <= _LEAD.ratio * stated + _LEAD.margin]
    if is_fixed or not others or stated >= _MAX_ANGLE:
        return None
    return (
        f"The file is read with {expected}; {' or '.join(others)} would fit these cameras as well. Check with "
        "the pictures that the cameras stand where they should."
    )


def odd_camera(Ts_stated: Sequence[Array]) -> int | None:
    """Return the index of the one camera that does not see the place that all others see; None if there is none.

    Args:
        Ts_stated: poses from world to camera, (4, 4), in any unit. Of fewer than four, no three agree without one.
    """
    chosen = spread_indices(len(Ts_stated), _MAX_COMPARED).tolist()
    if len(chosen) < 4:
        return None
    without = {i: _cost([rigid.inverse(Ts_stated[k]) for k in chosen if k != i]) for i in chosen}
    odd = min(without, key=lambda i: without[i])
    is_odd = is_clearly_worse(best_cost(Ts_stated)[0], without[odd], len(chosen) - 1)
    return odd if is_odd else None


def is_clearly_worse(cost: float, best: float, n_cameras: int) -> bool:
    """Return whether the best of several readings fits some cameras, and another, of a given cost, does not."""
    ratio, margin = _LEAD_OF_PAIR if n_cameras == 2 else _LEAD
    return best < FITS_DEG and cost > ratio * best + margin


def best_cost(Ts_stated: Sequence[Array], convention: PoseConvention | None = None) -> tuple[float, PoseConvention]:
    """Return the cost of a convention; of the one that fits best, if None is given."""
    cost = costs(Ts_stated)
    best: PoseConvention = min(cost, key=lambda c: cost[c]) if convention is None else convention
    return cost[best], best


def _distinct(conventions: Sequence[PoseConvention], Ts_stated: Sequence[Array]) -> list[PoseConvention]:
    """Leave out conventions that read the same rig, as seen from its first camera, as the stated one or another."""
    found: list[PoseConvention] = []
    for convention in conventions:
        rig = _from_first(Ts_stated, convention)
        if not any(np.allclose(rig, _from_first(Ts_stated, c), atol=ROUNDING) for c in (STATED, *found)):
            found.append(convention)
    return found


def _from_first(Ts_stated: Sequence[Array], convention: PoseConvention) -> Array:
    Ts = np.array([read_pose(T, convention) for T in Ts_stated])
    scale = max(float(np.abs(Ts[:, :3, 3]).max()), TINY)
    Ts[:, :3, 3] /= scale
    return Ts @ rigid.inverse(Ts[0])


def in_words(convention: PoseConvention) -> str:
    """Return what R and t of a convention mean."""
    kind = convention.removesuffix("-opengl")
    axes = ", with the camera's axes of OpenGL (y up, z backwards)" if kind != convention else ""
    return _MEANING[kind] + axes


def _rewrite(convention: PoseConvention) -> str:
    kind = convention.removesuffix("-opengl")
    return _REWRITE[kind] + (", then negate the last two rows of R' and t'" if kind != convention else "")


_ORDERS = {order: [order.split(", ").index(letter) for letter in "wxyz"] for order in ("w, x, y, z", "x, y, z, w")}
"""Places of w, x, y and z among the four numbers."""
_ALONG = 0.02
"""Share of the length of a row by which rectified cameras stand beside it: their rows are exact but for rounding.
Halved and doubled: no change in tests/tracker/formats/calibrations."""


def with_quaternions(sections: Mapping[str, Section], where: str, poses: PoseConvention | None) -> dict[str, Section]:
    """Return the sections with matrices in place of quaternions, in the order of numbers that fits the cameras.

    Args:
        sections: cameras by name; those whose rotation has four numbers are changed.
        where: names the file in messages.
        poses: convention of the poses by the user's choice; None to compare with all.

    Raises:
        CalibrationError: a quaternion has not length 1, or both orders fit.
    """
    quaternions = {name: plain_array(s["rotation"]) for name, s in sections.items()}
    quaternions = {name: q for name, q in quaternions.items() if q.shape == (4,)}
    if not quaternions:
        return dict(sections)
    for name, q in quaternions.items():
        if rotation_of_quaternion(q) is None:
            raise CalibrationError(
                f"{where}, camera {quoted(name)}: expected a quaternion of length 1 as rotation, found one of length "
                f"{np.linalg.norm(q):.4g}; rewrite the rotations as 3x3 matrices"
            )
    turned = {
        words: {name: rigid.matrix_from_quaternion(q[places]) for name, q in quaternions.items()}
        for words, places in _ORDERS.items()
    }
    rigs = {words: _rig(sections, rotations) for words, rotations in turned.items()}
    n_cameras = min(map(len, rigs.values()))
    fits = {words: best_cost(rig, poses)[0] if n_cameras > 1 else 0.0 for words, rig in rigs.items()}
    chosen, other = sorted(_ORDERS, key=lambda words: fits[words])
    if not is_clearly_worse(fits[other], fits[chosen], n_cameras):
        found = f"quaternions whose numbers may be {' or '.join(_ORDERS)}"
        expected = "rotations as 3x3 matrices or rotation vectors"
        raise CalibrationError.mismatch(where, expected, found, Remedy("name_quaternion"))
    return {
        name: section | ({"rotation": turned[chosen][name].tolist()} if name in quaternions else {})
        for name, section in sections.items()
    }


def _rig(sections: Mapping[str, Section], rotations: Mapping[str, Array]) -> list[Array]:
    """Return the stated poses of the cameras that have a rotation, (4, 4)."""
    translations = {name: plain_array(sections[name]["translation"]) for name in rotations}
    return [rigid.transform(R, translations[name]) for name, R in rotations.items() if translations[name].shape == (3,)]


def refuse_angles(sections: Mapping[str, Section], Ts_stated: Sequence[Array], where: str) -> None:
    """Refuse rotation vectors that are angles about x, y and z, where the cameras see one place by these alone.

    Args:
        sections: the cameras by name.
        Ts_stated: their poses as stated, with rotation vectors, (4, 4).
        where: names the file in messages.

    Raises:
        CalibrationError: they are angles.
    """
    vectors = [plain_array(section["rotation"]) for section in sections.values()]
    if len(vectors) < 2 or any(vector.shape != (3,) for vector in vectors):
        return
    fits = {}
    for order in permutations(range(3)):
        rig = [rigid.transform(_by_angles(v, order), T[:3, 3]) for v, T in zip(vectors, Ts_stated, strict=True)]
        fits[order] = best_cost(rig)
    order = min(fits, key=lambda order: fits[order][0])
    cost, convention = fits[order]
    if is_clearly_worse(best_cost(Ts_stated)[0], cost, len(vectors)):
        product = " ".join(f"R{'xyz'[axis]}" for axis in order)
        found = f"that they do if the numbers are angles about x, y and z (R = {product}, with {in_words(convention)})"
        expected = "rotation vectors (Rodrigues), by which the cameras see no one place"
        raise CalibrationError.mismatch(where, expected, found, "rewrite the rotations as 3x3 matrices")


def _by_angles(angles: Array, order: Sequence[int]) -> Array:
    """Return the product, in an order, of the turns by angles about x, y and z, (3,)."""
    first, second, third = (so3_exp(angles[axis] * np.eye(3)[axis]) for axis in order)
    return first @ second @ third


def check_turned(Ts_world_camera: Sequence[Array], where: str) -> str | None:
    """Doubt cameras that all have the same rotation, as files have that were not filled in.

    Args:
        Ts_world_camera: poses of the cameras, (4, 4).
        where: names the file in messages.

    Returns:
        A note, if they stand side by side as rectified cameras do; None if their rotations differ.

    Raises:
        CalibrationError: they stand otherwise.
    """
    Ts = np.asarray(Ts_world_camera)
    # Calibrated cameras never agree to their last digits.
    if len(Ts) < 2 or np.abs(Ts[:, :3, :3] - Ts[0, :3, :3]).max() > ROUNDING:
        return None
    moves = (Ts[:, :3, 3] - Ts[0, :3, 3]) @ Ts[0, :3, :3]
    reach = np.abs(moves).max(axis=0)
    is_zero = np.abs(Ts[0, :3, :3] - np.eye(3)).max() <= ROUNDING
    found = "all rotations are 0" if is_zero else "all rotations are equal"
    along = max(reach[0], reach[1])
    if along > ROUNDING * np.abs(Ts[:, :3, 3]).max() and min(reach[0], reach[1]) + reach[2] <= _ALONG * along:
        return f"{found.capitalize()}: check that the cameras are parallel, as rectified ones are."
    seen = f"that {found}, while the cameras do not stand in a row as rectified ones do"
    raise CalibrationError.mismatch(where, "the rotation of each camera", seen, Remedy("keep_rotations"))
