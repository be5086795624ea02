"""Draw the expected errors of the joints of the selected person, as ellipses in each view."""

import numpy as np

from app.drawing.overlays import Path
from app.drawing.seen_bodies import bodies_in, picture_times
from app.state.page_view import View
from app.state.state import State
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.session.session import Session

ELLIPSE_SIGMAS = float(np.sqrt(-2 * np.log(1 - 0.9)))
"""Semi-axis of the ellipse that holds 90% of a normal error in a plane, standard deviations: the square root of 4.605,
the 90% quantile of the chi-square distribution of two degrees of freedom."""
_MIN_SEMI_AXIS_PX = 3.0
"""Longest semi-axis of an ellipse that is left out, picture pixels: the mark of the joint would cover it."""
_PIECES = 48
"""Lines per ellipse. They depart from it by 0.2% of its semi-axis, below half a pixel up to 200 px."""


def error_ellipses(session: Session, state: State, view: View) -> list[Path]:
    """Draw the error ellipses of the selected person in the views that a page shows; none where no errors are known."""
    state = state.drawn
    person, shown = state.person, state.people[state.person]
    if "errors" not in view.layers or shown.errors is None or person in state.people_not_drawn:
        return []
    info, out = session.people[person], []
    body = bodies_in(session, state)[person]
    for index, time in picture_times(session, state.frame, view.cameras).items():
        points = body.ahead(time).points_world
        outlines_px = ellipses(
            session.cameras[index].camera.pinhole, points, shown.errors, _MIN_SEMI_AXIS_PX * view.reductions[index]
        )
        segments_px = np.concatenate([outlines_px[:, :-1], outlines_px[:, 1:]], axis=-1).reshape(-1, 4)
        out.append(Path(index, person, "error", info.color, segments_px.astype(np.float32)))
    return out


def ellipses(camera: Camera, points_world: Array, covariances: Array, min_px: float = 0.0) -> Array:
    """Return the ellipses that hold 90% of the errors of points in an image, to first order.

    The image of the ellipsoid that holds 90% of the error in space would be larger by 17%.

    Args:
        camera: the view.
        points_world: (n, 3), metres.
        covariances: of the errors of the points, (n, 3, 3), m^2.
        min_px: longest semi-axis of an ellipse that is left out, px.

    Returns:
        Closed outlines, (m, `_PIECES` + 1, 2), undistorted px, without those of points behind the near plane.
    """
    centers_px, px_by_point = camera.project_with_jacobian(points_world)
    covariances_px = px_by_point @ covariances @ px_by_point.swapaxes(1, 2)
    variances, axes = np.linalg.eigh(covariances_px)
    semi_axes_px = ELLIPSE_SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    is_drawn = (camera.depths(points_world) >= NEAR_PLANE_M) & (semi_axes_px[:, 1] > min_px)
    angles = np.linspace(0.0, 2 * np.pi, _PIECES + 1)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    circle[-1] = circle[0]
    return centers_px[is_drawn, None] + (circle * semi_axes_px[is_drawn, None]) @ axes[is_drawn].swapaxes(1, 2)
