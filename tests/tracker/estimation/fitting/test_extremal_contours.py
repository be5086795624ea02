"""Contour kernels against the extremal contours of Knossow, Ronfard & Horaud 2008 (KRH08)."""

import numpy as np
import pytest
from finite_differences import slopes
from krh08_plain import grazing_angles, linearize, normal_of, surface_point
from staging import camera_at, cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.estimation.fitting.contour_residuals import ContourResiduals, paper_match
from tracker.estimation.fitting.twists import SINGULAR, add_twists, sliding_speed, twists_to_dofs, unit_eye
from tracker.evidence.contours.occluding_contours import trace
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.shapes import EllipticalCone

BODY = load_model("knossow54", 1.75)


def cases(n, seed):
    """Random poses of the body, cones of it, cameras, and points on their contour generators.

    Yields:
        The body, index of the part, the camera, the angle of the ruling and the height of the point on it.
    """
    rng = np.random.default_rng(seed)
    while n:
        values = BODY.clip(BODY.retract(BODY.neutral(), rng.normal(0, 1.0, BODY.n_dofs)))
        values[:3] = rng.normal(0, 0.3, 3)
        body, part, direction = PosedBody(BODY, values), int(rng.integers(len(BODY.parts))), rng.normal(size=3)
        camera = camera_at("any", rng.uniform(2, 6) * direction / np.linalg.norm(direction), rng.normal(0, 0.2, 3))
        angles, z = rulings_of(body, part, camera), rng.uniform(-1, 1) * BODY.shapes[part].half_axes[2]
        if not angles:
            continue  # seen from within its extension: only the ends have a contour
        theta = angles[int(rng.integers(2))]
        if conditioning(BODY.shapes[part], theta, z, eye_of(body, part, camera)) > 5 * SINGULAR:
            yield body, part, camera, theta, z
            n -= 1


def cone_pose(body, part):
    """T_world_cone: the cone's frame lies at the centre of the part's shape."""
    return body.kinematics.Ts_world_part[part] @ rigid.transform(t=BODY.centers_part[part])


def eye_of(body, part, camera):
    """The camera's centre in the frame of a cone, (3,)."""
    return rigid.apply(rigid.inverse(cone_pose(body, part)), camera.center_world)


def rulings_of(body, part, camera):
    """Angles of the two rulings of a part in a camera, or none."""
    return grazing_angles(BODY.shapes[part], eye_of(body, part, camera))


def conditioning(shape, theta, z, eye):
    """Sine of the angle between the line of sight and the neighbouring tangent planes."""
    (a, b, _), sight = shape.half_axes, surface_point(shape, theta, z) - eye
    turned = np.array([-b * np.sin(theta), a * np.cos(theta), 0.0])
    return abs(sight @ turned) / (np.linalg.norm(sight) * np.linalg.norm(turned))


def contour_px(body, part, camera, near, z):
    """Image of the contour point at height z on the ruling nearest to an angle, (2,)."""
    angles = np.array(rulings_of(body, part, camera))
    theta = angles[np.argmin(np.abs(np.angle(np.exp(1j * (angles - near)))))]
    return camera.project(rigid.apply(cone_pose(body, part), surface_point(BODY.shapes[part], theta, z)))


def normal_px(camera, T_world_cone, shape, theta):
    """Unit normal of the image of a ruling, which is straight, (2,)."""
    ends = [surface_point(shape, theta, z * shape.half_axes[2]) for z in (-0.5, 0.5)]
    along = np.subtract(*camera.project(rigid.apply(T_world_cone, np.array(ends))))
    return np.array([along[1], -along[0]]) / np.linalg.norm(along)


def twist_row(T_world_cone, shape, camera, theta, z, slope=None):
    """Squares (6, 6) and gradient (6,) by the twist of a cone, by the kernel, of one residual of value 1.

    The residual is the motion of a contour point across the contour, or along an image gradient `slope`, (2,), with
    the point sliding on the surface.
    """
    W = T_world_cone[:3] * [*shape.half_axes, 1.0]
    point = surface_point(shape, theta, z)
    x = camera.project(rigid.apply(T_world_cone, point))
    pieces = np.array([*x, 1.0, *normal_px(camera, T_world_cone, shape, theta), *point / shape.half_axes], np.float32)
    pulls = np.array([1.0, 1.0, 0, 0, 0, 0, 0])
    if slope is not None:
        u, v = slope
        pulls = np.array([0, 0, u * u, u * v, v * v, u, v])
    M, b = np.zeros((6, 6)), np.zeros(6)
    eye, is_sliding = camera.center_world, slope is not None
    add_twists(np.array([0, 1]), pieces[:, None], pulls[:, None], camera.projection, W, eye, is_sliding, M, b)
    return M, b


def row_of_kernels(body, part, camera, theta, z, slope=None):
    """Gradient (n_dofs,) and Hessian of the residual of `twist_row` by the degrees of freedom, by the kernels."""
    n, kinematics = len(BODY.parts), body.kinematics
    M, b = np.zeros((n, 6, 6)), np.zeros((n, 6))
    M[part], b[part] = twist_row(cone_pose(body, part), BODY.shapes[part], camera, theta, z, slope)
    gradient, hessian = np.empty(BODY.n_dofs), np.empty((BODY.n_dofs, BODY.n_dofs))
    twists_to_dofs(
        M, b, kinematics.axes_world, kinematics.origins_world, BODY.dof_is_length, BODY.dof_joint, BODY.tree.parents,
        BODY.moves, gradient, hessian,
    )  # fmt: skip
    return gradient, hessian


@pytest.mark.parametrize("block", [0, *(pytest.param(b, marks=pytest.mark.slow) for b in (1, 2, 3))])
def test_kernels_move_extremal_contours_as_central_differences_do(block):
    """Eq. 55 across the contour, and along any slope of the distance where it slides, to 1e-3.

    The contour generator is found again at every pose, so that it slides as the pose changes. Sliding does not move a
    contour across itself: the row across has no sliding term.
    """
    rng, n_sliding = np.random.default_rng(block), 0
    for body, part, camera, theta, z in cases(60, block):
        moved = slopes(lambda b, case=(part, camera, theta, 0.99 * z): contour_px(b, *case), body, 2e-6)
        across, slope = normal_px(camera, cone_pose(body, part), BODY.shapes[part], theta), rng.normal(size=2)
        for direction, sliding in ((across, None), (slope, slope)):
            row = moved @ direction
            gradient, hessian = row_of_kernels(body, part, camera, theta, 0.99 * z, sliding)
            np.testing.assert_allclose(gradient, row, atol=1e-3 * np.abs(row).max())
            np.testing.assert_allclose(hessian, np.outer(row, row), atol=1e-3 * np.abs(row).max() ** 2)
        across_of_slope = (slope @ across) * (moved @ across)
        n_sliding += np.abs(moved @ slope - across_of_slope).max() > 0.01 * np.abs(moved @ slope).max()
    assert n_sliding > 30


def test_near_singular_rulings_are_finite_and_weighted_down():
    """From where the two rulings meet, the sliding speed would grow without bound."""
    cone, z = EllipticalCone((0.05, 0.08, 2.0), 0.8), 1.9
    W, speeds = np.diag([*cone.half_axes, 1.0])[:3], []
    for gap in (0.5, 1e-2, 1e-4, 1e-8, 1e-14):
        # The eye stands on the normal through a surface point, at a distance `gap` from the surface.
        X, n = surface_point(cone, 0.3, 0.1), normal_of(cone, 0.3)
        eye = X + gap * n / np.linalg.norm(n)
        theta = grazing_angles(cone, eye)[0]
        point = surface_point(cone, theta, z)
        square = np.sum((point - eye) ** 2)
        speed = sliding_speed(*point / cone.half_axes, np.cos(theta), np.sin(theta), square, unit_eye(W, eye))
        speeds.append(abs(speed))
        assert (conditioning(cone, theta, z, eye) < SINGULAR) == (gap < 1e-2)
    assert np.all(np.isfinite(speeds))
    assert speeds[1] > 10 * speeds[0]
    assert max(speeds[-2:]) < 0.1 * speeds[0]  # its weight falls to nothing


@pytest.mark.parametrize("motion", ["rigid", "sliding"])
def test_normal_equations_agree_with_the_plain_version(motion):
    """All visible contour points of a frame, Eq. 60-61: the kernels against numpy, point by point."""
    body = PosedBody(BODY, posed(BODY, 3))
    views = own_evidence([PosedBody(BODY, BODY.retract(body.values, np.full(BODY.n_dofs, 0.03)))], cameras_around(3))
    found = ContourResiduals(views, [body], settings=paper_match(motion), theta_px=1e4, everywhere=True)
    got = found.linearize(BODY, body.values, BODY.kinematics(body.values))
    plain = linearize(BODY, body.values, views, motion == "sliding")
    w = plain.lengths
    H = (plain.jacobian * w[:, None]).T @ plain.jacobian
    np.testing.assert_allclose(got.cost, 0.5 * np.sum(w * plain.distances**2), rtol=2e-3)
    np.testing.assert_allclose(
        got.gradient, plain.jacobian.T @ (w * plain.distances), atol=5e-3 * np.sqrt(2 * got.cost * np.diag(H).max())
    )
    np.testing.assert_allclose(got.hessian, H, atol=5e-3 * np.diag(H).max())


def test_traced_contours_lie_on_the_rulings():
    """The kernels' pieces on the curved surface solve Eq. 13: they lie on a ruling to 0.15 px, or on an end's rim.

    A corner that is within 0.1 px of the line between its neighbours is left out of a contour.
    """
    on_ruling = 0
    for seed in range(5):
        body = PosedBody(BODY, posed(BODY, seed))
        for camera in cameras_around(3):
            contours = trace([body], camera)
            for part in range(len(BODY.parts)):
                shape, T = BODY.shapes[part], cone_pose(body, part)
                own = rigid.apply(rigid.inverse(T), contours.points_world[contours.parts == part].astype(float))
                side = np.abs(own[:, 2]) < 0.999 * shape.half_axes[2]
                angles = rulings_of(body, part, camera)
                if not angles:
                    assert not side.any()
                    continue
                px = camera.project(rigid.apply(T, own[side]))
                off = []
                for theta in angles:
                    x = camera.project(rigid.apply(T, surface_point(shape, theta, 0.0)))
                    off.append(np.abs((px - x) @ normal_px(camera, T, shape, theta)))
                if side.any():
                    assert np.min(off, axis=0).max() < 0.15
                    on_ruling += int(side.sum())
    assert on_ruling > 1000


@pytest.mark.parametrize("where", ["inside the extension", "end on", "inside the part", "behind the camera"])
def test_degenerate_views_give_finite_normal_equations(where):
    """Where a cone shows its end alone, or nothing, its residuals are finite; what is behind a camera has none."""
    body = PosedBody(BODY, posed(BODY, 3))
    T = cone_pose(body, BODY.part_index["left_thigh"])
    axis, middle = T[:3, 2], T[:3, 3]
    eye, target = {
        "inside the extension": (middle + 3.0 * axis + 0.01, middle),
        "end on": (middle - 3.0 * axis, middle),
        "inside the part": (middle + 0.01, middle + 1.0),
        "behind the camera": (middle + 2 * axis, middle + 4 * axis),
    }[where]
    views = own_evidence([body], [camera_at("odd", eye, target), *cameras_around(2)])
    found = ContourResiduals(views, [body]).linearize(BODY, body.values, BODY.kinematics(body.values))
    assert np.isfinite(found.cost)
    assert np.all(np.isfinite(found.gradient))
    assert np.all(np.isfinite(found.hessian))
    assert found.hessian.any()
