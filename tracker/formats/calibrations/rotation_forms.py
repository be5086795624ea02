"""Resolve ambiguous rotations by the optical axes and centres of the cameras that each reading gives.

Four numbers are a quaternion with its real part first or last. Three numbers are a rotation vector or angles about the
axes. Rotations that are all equal are parallel cameras or were never filled in.
"""

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np

from tracker.errors import CalibrationError, Remedy
from tracker.formats.calibrations.camera_matrices import plain_array, rotation_of_quaternion
from tracker.formats.calibrations.camera_words import Section
from tracker.formats.calibrations.convention_names import PoseConvention
from tracker.formats.calibrations.pose_conventions import best_cost, in_words, is_clearly_worse
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.rigid import so3_exp
from tracker.validation import ROUNDING, quoted

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
