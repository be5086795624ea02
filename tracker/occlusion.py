"""What of posed bodies a camera sees besides their contours: single points, and the curves where parts meet."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker import contours
from tracker.body import Body
from tracker.cameras import Camera
from tracker.contours import FloatArray
from tracker.rigid import Array

_LIFT_M = 0.012
"""How far a curve is lifted off the surfaces to see whether they hide it, metres."""


def points_hidden(bodies: Sequence[Body], camera: Camera, points_world: Array) -> NDArray[np.bool_]:
    """Whether a part hides each point, (n,); parts that hold the point itself, as around a joint, do not count.

    Args:
        bodies: everybody in the scene.
        camera: the view.
        points_world: (n, 3), metres.
    """
    surfaces = contours.surfaces_of(tuple(b.model for b in bodies))
    Ts = contours.part_poses(bodies)
    shapes = [s for b in bodies for s in b.model.shapes]
    holds = np.stack(
        [
            shape.inside_outside((points_world - T[:3, 3]) @ T[:3, :3] - center) < 1.5
            for shape, T, center in zip(shapes, Ts, surfaces.centers, strict=True)
        ]
    )
    return _blocked(camera, Ts, surfaces, points_world.astype(np.float32), holds)


def part_edges(bodies: Sequence[Body], camera: Camera) -> FloatArray:
    """Where surfaces of parts intersect: drawn for the eye, never matched (GD96 Sect. 5).

    The surface of each part is cut by the implicit function of every part near it; what some part hides is left out.

    Returns:
        End points x0, y0, x1, y1 in undistorted px, (N, 4).
    """
    surfaces = contours.surfaces_of(tuple(b.model for b in bodies))
    Ts = contours.part_poses(bodies)
    shapes = [s for b in bodies for s in b.model.shapes]
    P = contours.projection(camera)
    segments = np.empty((6 * (contours.N_RINGS + contours.N_SECTORS), 2, 3), np.float32)
    shown = [np.empty((0, 4), np.float32)]
    for a in range(len(shapes)):
        grid = surfaces.points[a] @ Ts[a, :3, :3].T + Ts[a, :3, 3]
        for b in range(a):  # each pair once: the curve lies on both surfaces
            apart = Ts[a, :3] @ (*surfaces.centers[a], 1.0) - Ts[b, :3] @ (*surfaces.centers[b], 1.0)
            if np.linalg.norm(apart) > surfaces.shapes[a, 7] + surfaces.shapes[b, 7]:
                continue
            local = (grid - Ts[b, :3, 3]) @ Ts[b, :3, :3] - surfaces.centers[b]
            # The root makes the implicit function nearly linear across the surface, as interpolation wants it.
            depth = shapes[b].inside_outside(local) ** (shapes[b].exponents[0] / 2) - 1.0
            n = contours.zero_line(depth.astype(np.float32), grid.astype(np.float32), segments)
            out = contours.contour_buffer(camera, 1)
            n = contours.cut(segments, n, P, contours.PIECE_PX, 0, out)
            points = out.points_world[:n]
            # Where both surfaces face the camera, a small way towards it leads out of both parts.
            towards = camera.center_world - points
            lifted = points + _LIFT_M * towards / np.linalg.norm(towards, axis=-1, keepdims=True)
            nothing = np.zeros((len(shapes), n), dtype=bool)
            shown.append(out.pieces_px[:n][~_blocked(camera, Ts, surfaces, lifted.astype(np.float32), nothing)])
    return np.concatenate(shown)


def _blocked(
    camera: Camera, Ts: Array, surfaces: contours.Surfaces, points: FloatArray, ignored: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether some part lies before each point (n, 3), but for the parts ignored for it, (P, n)."""
    hidden = np.zeros(len(points), dtype=bool)
    Ts_part_world = np.swapaxes(Ts[:, :3, :3], 1, 2)
    for part in range(len(Ts)):
        center = surfaces.centers[part]
        transform = np.column_stack([Ts_part_world[part], -Ts_part_world[part] @ Ts[part, :3, 3] - center])
        eye = transform @ (*camera.center_world, 1.0)
        blocker = contours.Blockers(np.array([part]), transform[None], eye[None], np.ones(1))
        seen = np.flatnonzero(~hidden & ~ignored[part])
        by_part = np.zeros(len(seen), dtype=bool)
        contours.hide(0, len(seen), blocker, 0, surfaces.shapes, points[seen], by_part)
        hidden[seen] |= by_part
    return hidden
