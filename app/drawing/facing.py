"""Show where the heads of people face: an arrow from the face, in the views and in 3-D."""

from functools import lru_cache

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, FloatArray, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

_HEAD = "head"
_LENGTH, _BARB = 0.1, 0.028
"""Length of the arrow from the face, and of its barbs forwards and sidewards, fractions of the body height."""
_NOSE = (0.034, 0.016)
"""Length and half width of the nose of the 3-D view, fractions of the body height."""


def facing_arrow(body: PosedBody, camera: Camera) -> tuple[FloatArray, bool]:
    """Project the arrow of a head into a view.

    Args:
        body: the posed body.
        camera: the view.

    Returns:
        Its segments x0, y0, x1, y1, (4, 4), undistorted px, none for a body without a head or behind the camera; and
        whether it points away from the camera.
    """
    model = body.model
    if _HEAD not in model.part_index:
        return np.zeros((0, 4), np.float32), False
    part = model.part_index[_HEAD]
    face = face_part(model)
    tip, barb = face + np.array([_LENGTH * model.height_m, 0.0, 0.0]), _BARB * model.height_m
    barbs = tip + barb * np.array([(-1.0, -1.0, 0.0), (-1.0, 1.0, 0.0), (-1.0, 0.0, -1.0)])
    points = rigid.apply(body.kinematics.Ts_world_part[part], np.vstack([face, tip, barbs]))
    depths = camera.depths(points)
    if depths.min() < NEAR_PLANE_M:
        return np.zeros((0, 4), np.float32), False
    px = camera.project(points)
    lines = np.array([[px[0], px[1]], *([px[1], end] for end in px[2:])])
    return lines.reshape(-1, 4).astype(np.float32), bool(depths[1] > depths[0])


@lru_cache(maxsize=32)
def face_part(model: BodyModel) -> Array:
    """Return the middle of the face in the frame of the head, (3,), metres; cached, because models are immutable."""
    part = model.part_index[_HEAD]
    vertices = model.shapes[part].triangles().vertices
    return np.asarray(model.centers_part[part] + (vertices[:, 0].max(), 0.0, 0.0))


def nose(model: BodyModel, part: int) -> tuple[Array, IntArray]:
    """Return the vertices, (n, 3), and triangles, (m, 3), of a nose in the frame of the head, metres.

    They are empty for any other part.
    """
    if model.parts[part].name != _HEAD:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    length, width = _NOSE[0] * model.height_m, _NOSE[1] * model.height_m
    corners = np.array(
        [(length, 0, -0.3 * width), (-width, -width, -width), (-width, width, -width), (-width, 0, width)]
    )
    return face_part(model) + corners, np.array([(0, 2, 1), (0, 3, 2), (0, 1, 3)])
