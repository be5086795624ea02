from dataclasses import replace

import numpy as np
import pytest
from fisheye import with_fisheye
from scipy.spatial import cKDTree
from staging import at, camera_at, cameras_around, solid

from tracker.body.model import PosedBody
from tracker.evidence.contours.occluding_contours import trace
from tracker.evidence.contours.pieces import PIECE_PX
from tracker.evidence.contours.surfaces import N_SECTORS
from tracker.evidence.contours.visibility import JOINT_MARGIN_M
from tracker.formats.model_toml import parse_model

FRONT = camera_at("front", (4.0, 0.0, 0.0))

# A cell of the grid spans 15 degrees around (12 along), and a chord of an arc of that width runs inside the arc by up
# to 1 - cos(7.5 degrees) of its radius. A segment's ends lie on such chords, and it is a chord again.
INWARD = 2 * (1 - np.cos(np.pi / N_SECTORS))

PLATE_M = 0.02
BALL_ON_PLATE = """
version = 1
name = "ball on plate"
height_m = 1.0
parts = [
    { name = "ball", half_axes = [0.1, 0.1, 0.1] },
    { name = "plate", half_axes = [0.02, 0.3, 0.3], exponents = [0.3, 0.3] },
]
joints = [
    { name = "root", child = "ball", free = true },
    { name = "link", parent = "ball", child = "plate", position = [BEHIND, 0, 0] },
]
"""


def ball():
    return solid((0.1, 0.1, 0.1))


def outline(half_axes, T_world_part, camera):
    """The ellipse in which a camera sees an ellipsoid, as a conic (3, 3): the projection of its dual quadric."""
    P = camera.K @ camera.T_camera_world[:3]
    dual = T_world_part @ np.diag([*np.square(half_axes), -1.0]) @ T_world_part.T
    C = np.linalg.inv(P @ dual @ P.T)
    return C * np.sign(np.trace(C[:2, :2]))


def off_outline(C, points_px):
    """Distance of points from an ellipse to first order (Sampson's), positive outside, px."""
    h = np.column_stack([points_px, np.ones(len(points_px))])
    return np.einsum("ni,ij,nj->n", h, C, h) / (2 * np.linalg.norm((h @ C)[:, :2], axis=1))


def ellipse_points(C, n=400):
    """Points on an ellipse, (n, 2)."""
    center = np.linalg.solve(C[:2, :2], -C[:2, 2])
    scale = -np.array([*center, 1.0]) @ C @ np.array([*center, 1.0])
    half = np.linalg.cholesky(np.linalg.inv(C[:2, :2] / scale))
    a = np.linspace(0, 2 * np.pi, n)
    return center + np.stack([np.cos(a), np.sin(a)], axis=1) @ half.T


def middles(contour, where=slice(None)):
    return (contour.pieces_px[where, :2] + contour.pieces_px[where, 2:]) / 2


def dense(pieces_px):
    """Points along pieces, every quarter of a piece."""
    t = np.linspace(0, 1, 5)[:, None, None]
    return (pieces_px[:, :2] + t * (pieces_px[:, 2:] - pieces_px[:, :2])).reshape(-1, 2)


@pytest.mark.parametrize("half_axes", [(0.1, 0.1, 0.1), (0.06, 0.1, 0.18), (0.3, 0.3, 0.3)])
def test_ellipsoid_projects_to_its_ellipse(half_axes):
    model = solid(half_axes)
    body = at(model, 0.1, 0.2, 0.1, turns=(0.3, 0.4, 0.5))
    T = model.kinematics(body.values).Ts_world_part[0]
    for camera in cameras_around():
        contours = trace([body], camera)
        off = off_outline(outline(half_axes, T, camera), dense(contours.pieces_px))
        radius_px = 520 * max(half_axes) / (4 - 0.3)
        # Never outside (0.02 px for single precision), and inside by what the grid leaves: 0.2 px for the 10 cm of a
        # head or a limb at this distance, in proportion for what is larger.
        assert off.max() < 0.02
        assert off.min() > -INWARD * radius_px
        assert max(half_axes) > 0.1 or off.min() > -0.2
        # All of the ellipse is there, once.
        ellipse = ellipse_points(outline(half_axes, T, camera))
        # dense() leaves half a px between its points, beside what the pieces lie inside.
        assert cKDTree(dense(contours.pieces_px)).query(ellipse)[0].max() < INWARD * radius_px + 0.55
        drawn = np.linalg.norm(contours.pieces_px[:, 2:] - contours.pieces_px[:, :2], axis=1).sum()
        assert drawn == pytest.approx(np.linalg.norm(np.diff(ellipse, axis=0), axis=1).sum(), rel=0.02)
        assert not contours.occluded.any()


def test_contour_points_lie_on_the_surface_and_graze_it():
    half_axes = np.array([0.06, 0.1, 0.18])
    model = solid(half_axes)
    body = at(model, 0.1, 0.2, 0.1, turns=(0.3, 0.4, 0.5))
    T = model.kinematics(body.values).Ts_world_part[0]
    for camera in cameras_around():
        points = (trace([body], camera).points_world - T[:3, 3]) @ T[:3, :3]
        # The root of an ellipsoid's implicit function is the distance from the centre in units of the radius there.
        radii = np.sqrt(model.shapes[0].inside_outside(points))
        assert np.all((radii > 1 - INWARD) & (radii < 1 + 1e-6))
        normals = points / half_axes**2
        sight = points - (camera.center_world - T[:3, 3]) @ T[:3, :3]
        cosines = np.sum(normals * sight, axis=1) / np.linalg.norm(normals, axis=1) / np.linalg.norm(sight, axis=1)
        assert np.abs(cosines).max() < 0.02  # 1 degree


def test_a_point_of_the_contour_is_seen_at_the_middle_of_its_piece(gavrila):
    camera = cameras_around(1)[0]
    contours = trace([PosedBody(gavrila, gavrila.neutral())], camera)
    np.testing.assert_allclose(camera.project(contours.points_world), middles(contours), atol=0.02)


@pytest.mark.parametrize("piece_px", [PIECE_PX, 2.0, 9.0])
def test_pieces_are_short_and_add_up_to_the_same(gavrila, piece_px):
    camera = cameras_around(1)[0]
    body = [PosedBody(gavrila, gavrila.neutral())]

    def lengths(contour):
        return np.linalg.norm(contour.pieces_px[:, 2:] - contour.pieces_px[:, :2], axis=1)

    found = lengths(trace(body, camera, piece_px))
    assert found.max() <= piece_px + 1e-3
    assert found.sum() == pytest.approx(lengths(trace(body, camera)).sum(), rel=1e-4)
    assert set(trace(body, camera).parts) == set(range(len(gavrila.parts)))


def test_parts_behind_are_hidden():
    large, small = solid((0.3, 0.3, 0.3), name="large"), ball()
    front, behind = at(large, 0, 0, 0), at(small, -1, 0.1, 0)
    contours = trace([front, behind], FRONT)
    assert contours.occluded[contours.parts == 1].all()
    assert not contours.occluded[contours.parts == 0].any()
    # Before it, the small one cuts nothing from the outline of the large one, and is seen whole.
    assert not trace([front, at(small, 1, 0.1, 0)], FRONT).occluded.any()
    assert not trace([front, at(small, -1, 1, 0)], FRONT).occluded.any()


def test_hidden_up_to_the_outline_of_what_hides():
    blocker, body = at(solid((0.15, 0.3, 0.2)), 0.6, 0.1, 0.1), at(solid((0.1, 0.3, 0.3)), -0.5, 0.2, -0.1)
    contours = trace([blocker, body], FRONT)
    T = blocker.model.kinematics(blocker.values).Ts_world_part[0]
    mine = contours.parts == 1
    off = off_outline(outline((0.15, 0.3, 0.2), T, FRONT), middles(contours, mine))
    occluded = contours.occluded[mine]
    assert 10 < occluded.sum() < len(occluded) - 10
    # Each piece is judged by its middle; at the very outline a line of sight that only grazes may pass.
    assert np.all(occluded[off < -0.5])
    assert not np.any(occluded[off > 0.1])


def test_people_hide_each_other():
    one, other = at(ball(), 0.5, 0.05, 0), at(ball(), -0.5, -0.05, 0)
    from_front = trace([one, other], FRONT)
    from_back = trace([one, other], camera_at("back", (-4.0, 0.0, 0.0)))
    for found, before in ((from_front, 0), (from_back, 1)):
        assert not found.occluded[found.parts == before].any()
        assert found.occluded[found.parts != before].any()
        assert not found.occluded[found.parts != before].all()
    # The order in which people are listed changes their numbers, nothing else.
    swapped = trace([other, one], FRONT)
    for part in (0, 1):
        np.testing.assert_array_equal(
            swapped.pieces_px[(swapped.parts == part) & ~swapped.occluded],
            from_front.pieces_px[(from_front.parts == 1 - part) & ~from_front.occluded],
        )


@pytest.mark.parametrize(("gap_m", "occluded"), [(JOINT_MARGIN_M - 0.01, True), (JOINT_MARGIN_M + 0.01, False)])
def test_no_contour_where_parts_adjoin(gap_m, occluded):
    """A ball before a plate, its outline by a gap before the plate's face: within the margin they merely meet."""
    depth = -(gap_m + PLATE_M)
    joined = parse_model(BALL_ON_PLATE.replace("BEHIND", str(depth)), "ball on plate")
    contours = trace([at(joined, 0, 0, 0, turns=())], FRONT)
    assert set(contours.occluded[contours.parts == 0]) == {occluded}
    # Bodies of their own in the same places share no joint: there is a contour between them.
    apart = trace([at(ball(), 0, 0, 0), at(solid((PLATE_M, 0.3, 0.3), (0.3, 0.3)), depth, 0, 0)], FRONT)
    assert not apart.occluded[apart.parts == 0].any()


def test_parts_do_not_hide_themselves():
    for exponents in ((0.35, 1), (0.5, 0.8), (1, 1)):
        body = at(solid((0.1, 0.15, 0.3), exponents), 0, 0, 0, turns=(0.5, 0.2, 0.9))
        for camera in cameras_around():
            assert not trace([body], camera).occluded.any()


def test_nothing_is_drawn_of_what_is_behind_the_camera():
    camera = camera_at("front", (4.0, 0.0, 0.0))
    assert len(trace([at(ball(), 6, 0, 0)], camera).parts) == 0  # behind
    assert len(trace([at(ball(), 4.05, 0, 0)], camera).parts) == 0  # around the camera
    assert len(trace([at(ball(), 4, 1, 0)], camera).parts) == 0  # astride its plane
    contours = trace([at(ball(), 6, 0, 0), at(ball(), 0, 0, 0)], camera)
    assert set(contours.parts) == {1}
    assert not contours.occluded.any()  # nor does it hide anything


def test_lens_distortion_is_left_out(gavrila):
    camera = cameras_around(1)[0]
    bent = replace(camera, distortion=np.array([-0.2, 0.05, 0.001, 0.001]))
    body = [PosedBody(gavrila, gavrila.neutral())]
    np.testing.assert_array_equal(trace(body, bent).pieces_px, trace(body, camera).pieces_px)


def test_contours_of_a_fisheye_lie_in_its_undistorted_picture(gavrila):
    camera = with_fisheye(cameras_around(1)[0])
    body = [PosedBody(gavrila, gavrila.neutral())]
    pieces = trace(body, camera).pieces_px
    np.testing.assert_array_equal(pieces, trace(body, camera.pinhole).pieces_px)
    filmed = camera.distort_points(pieces.reshape(-1, 2).astype(float))
    across = filmed[:, None] - camera.project(body[0].points_world)
    assert np.linalg.norm(across, axis=-1).min(axis=0).max() < 25  # no joint is far from an outline
