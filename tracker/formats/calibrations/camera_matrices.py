"""Shapes of the matrices of a camera: lens, pose, and the projection that holds both."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tracker.formats.anipose import FOUR_DIGITS
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.validation import ROUNDING

_MAX_SKEW = 0.1
"""Largest skew of a lens as a share of its focal length, 6 degrees: sensors are rectangles, and fits differ by less.
Halved and doubled: no change in tests/tracker/formats/calibrations."""
_MAX_ASPECT = 2.0
"""Largest ratio of the focal lengths: anamorphic footage has up to 2. 1.4 and 4: no change in
tests/tracker/formats/calibrations."""


class ProjectionError(ValueError):
    """A matrix that is the projection of no usable camera: `expected ..., found ...`."""


def plain_array(value: Any) -> Array:
    """Return an array of numbers; an empty one if it is none."""
    try:
        return np.array(value, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        return np.zeros(0)


def reshaped(value: Any, shapes: Mapping[int, tuple[int, ...]]) -> Any:
    """Give numbers the shape that belongs to their count; other data is returned as it is, to be refused by name."""
    array = plain_array(value)
    return value if array.size not in shapes else array.reshape(shapes[array.size]).tolist()


def homogeneous(value: Any) -> Array | None:
    """Return a pose of shape (3, 4) or (4, 4) as (4, 4), also one written for row vectors; None for anything else."""
    array = plain_array(reshaped(value, {12: (3, 4), 16: (4, 4)}))
    if array.shape not in ((3, 4), (4, 4)) or not np.isfinite(array).all():
        return None
    whole = np.eye(4)
    if array.shape == (4, 4) and np.any(array[3, :3]) and not np.any(array[:3, 3]):
        array = array.T
    whole[: len(array)] = array
    return whole if np.allclose(whole[3], (0, 0, 0, 1)) else None


def rotation_of_quaternion(wxyz: Any) -> Array | None:
    """Return the rotation, (3, 3), of four numbers w, x, y and z; None unless their length is 1."""
    q = plain_array(wxyz)
    return rigid.matrix_from_quaternion(q) if q.shape == (4,) and abs(np.linalg.norm(q) - 1) < FOUR_DIGITS else None


def is_transposed(matrix: Any) -> bool:
    """Return whether a matrix of a camera has its principal point in the last row."""
    K = plain_array(matrix)
    return K.shape == (3, 3) and not np.any(K[:2, 2]) and bool(np.all(K[2, :2] > 1))


def lens_matrix(known: Mapping[str, Any]) -> Any:
    """Return the matrix of a lens, (3, 3), from its words; None if they have none, other data as it is.

    Args:
        known: values by their meaning: `matrix`, of 3x3, with a column of zeros, or of fx, fy, cx and cy; or `focal`
            and `principal`; or the numbers apart.
    """
    matrix = known.get("matrix")
    if matrix is None:
        return _of_numbers(known)
    array = plain_array(matrix)
    if array.shape == (4,):  # as Kalibr writes it
        return _pinhole_matrix(array.tolist(), known)
    padded, whole = plain_array(reshaped(matrix, {12: (3, 4), 16: (4, 4)})), np.eye(4)
    if padded.shape in ((3, 4), (4, 4)):
        whole[:3, :3] = padded[:3, :3]
        return whole[:3, :3].tolist() if np.array_equal(padded, whole[: len(padded)]) else matrix
    return reshaped(matrix, {9: (3, 3)})


def _of_numbers(known: Mapping[str, Any]) -> Any:
    focal, principal = (plain_array(known.get(key)).ravel() for key in ("focal", "principal"))
    numbers = dict(known)
    if "focal" in known and focal.size in (1, 2):
        numbers |= {"fx": float(focal[0]), "fy": float(focal[-1])}
    if "principal" in known and principal.size == 2:
        numbers |= {"cx": float(principal[0]), "cy": float(principal[1])}
    if not {"fx", "fy", "cx", "cy"} <= numbers.keys():
        return None
    return _pinhole_matrix([numbers[key] for key in ("fx", "fy", "cx", "cy")], known)


def _pinhole_matrix(numbers: Sequence[Any], known: Mapping[str, Any]) -> list[list[Any]]:
    """Return the matrix of fx, fy, cx and cy, with the skew of the words, if they have one."""
    fx, fy, cx, cy = numbers
    return [[fx, known.get("skew", 0.0), cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def is_projection(value: Any) -> bool:
    """Return whether a value has the 12 numbers of a projection."""
    return plain_array(value).size == 12


def split_projection(value: Any) -> tuple[Array, Array]:
    """Split a projection K [R | t], known up to a factor, by an RQ decomposition.

    Args:
        value: (3, 4), or its 12 numbers by rows.

    Returns:
        K, (3, 3), px, and the pose from world to camera, (4, 4), in the unit of the world.

    Raises:
        ProjectionError: it is that of no camera, or of a mirrored one.
    """
    P = plain_array(value).reshape(3, 4)
    M = P[:, :3]
    depth = float(np.linalg.norm(M[2]))
    if not np.isfinite(P).all() or depth == 0 or np.linalg.matrix_rank(M) < 3:
        raise ProjectionError("expected the projection of a camera as 3x4 matrix, found one without a centre")
    if np.linalg.det(M) < 0:
        # A factor of -1 changes nothing, and fits leave it open; a matrix of K, R and t has none.
        if abs(depth - 1) < ROUNDING:
            raise ProjectionError("expected the projection of a camera as 3x4 matrix, found one that mirrors pictures")
        P, M = -P, -M
    K, R = _rq(M / depth)
    fx, fy, skew = K[0, 0], K[1, 1], K[0, 1]
    if not (1 / _MAX_ASPECT <= fx / fy <= _MAX_ASPECT and abs(skew) <= _MAX_SKEW * fx and (K[:2, 2] > 0).all()):
        raise ProjectionError(
            f"expected the projection of a camera as 3x4 matrix, found focal lengths {fx:.4g} and {fy:.4g}, skew "
            f"{skew:.4g} and principal point {K[0, 2]:.4g}, {K[1, 2]:.4g}"
        )
    t = np.asarray(np.linalg.solve(K, P[:, 3] / depth), dtype=np.float64)
    K[0, 1] = 0.0 if abs(skew) < ROUNDING * fx else skew
    return K, rigid.transform(R, t)


def _rq(M: Array) -> tuple[Array, Array]:
    """Decompose a matrix of determinant above 0 into an upper triangle of positive diagonal and a rotation."""
    Q, triangle = np.linalg.qr(M[::-1].T)
    K, R = triangle.T[::-1, ::-1], Q.T[::-1]
    signs = np.sign(np.diag(K))
    K, R = K * signs, signs[:, None] * R
    return np.triu(K / K[2, 2]), R
