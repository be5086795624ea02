"""Kinematics and contour kernels against the formulas of Knossow, Ronfard & Horaud 2008."""

import numpy as np
import pytest
from bodies import MODELS
from krh08_plain import linearize
from krh08_reference import SINGULAR, Cone, ZeroReference, distance, project, ruling
from staging import camera_at, cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.estimation.fitting.contour_residuals import ContourResiduals, paper_match
from tracker.estimation.fitting.twists import add_twists, twists_to_dofs
from tracker.evidence.contours.occluding_contours import trace
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.evidence.images.distance_transform import bilinear
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

REVOLUTE = [n for n, m in MODELS.items() if all(j.kind == "revolute" for j in m.joints)]
BODY = load_model("knossow54", 1.75)


def any_pose(model, rng):
    """A pose anywhere within the joint limits, the root turned any way."""
    return model.clip(model.retract(model.neutral(), rng.normal(0, 1.0, model.n_dofs)))


@pytest.mark.parametrize("name", REVOLUTE)
def test_zero_reference_kinematics_place_the_parts_alike(name):
    """Eq. 33-42 from any docking pose equal the kinematics that run."""
    model, rng = MODELS[name], np.random.default_rng(1)
    for _ in range(5):
        docking = np.concatenate([rng.normal(0, 2, 3), rng.uniform(-3, 3, 3)])
        values = any_pose(model, rng)
        expected = ZeroReference(model, docking).part_poses(values)
        np.testing.assert_allclose(model.kinematics(values).Ts_world_part, expected, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", REVOLUTE)
def test_the_jacobian_of_a_chain(name):
    """J_H of Eq. 43-54 equals central differences of the part's motion, and the Jacobian of points that runs."""
    model, rng = MODELS[name], np.random.default_rng(2)
    reference = ZeroReference(model, np.zeros(6))
    values, h = any_pose(model, rng), 1e-6
    kinematics = model.kinematics(values)
    for part in range(len(model.parts)):
        J = reference.J_H(values, part)
        T = kinematics.Ts_world_part[part]
        for k in range(model.n_dofs):
            step = h * np.eye(model.n_dofs)[k]
            up, down = (model.kinematics(model.retract(values, s)).Ts_world_part[part] for s in (step, -step))
            tangent = (up - down) / (2 * h) @ rigid.inverse(T)  # Eq. 44
            twist = [tangent[2, 1], tangent[0, 2], tangent[1, 0], *tangent[:3, 3]]
            np.testing.assert_allclose(J[:, k], twist, atol=1e-7)
        X = T[:3, 3] + rng.normal(0, 0.2, 3)
        moved = np.hstack([-rigid.skew(X), np.eye(3)]) @ J
        np.testing.assert_allclose(model.point_jacobian(kinematics, np.array([part]), X[None])[0], moved, atol=1e-9)


def cases(n, seed=0):
    """Random poses of the body, cones of it, cameras, and points on their contour generators.

    Yields:
        Values, index of the part, the cone, the camera, the angle of the ruling and the height of the point on it.
    """
    rng = np.random.default_rng(seed)
    while n:
        values, part = any_pose(BODY, rng), int(rng.integers(len(BODY.parts)))
        values[:3] = rng.normal(0, 0.3, 3)
        direction = rng.normal(size=3)
        camera = camera_at("any", rng.uniform(2, 6) * direction / np.linalg.norm(direction), rng.normal(0, 0.2, 3))
        cone = Cone.of(BODY.shapes[part])
        found = rulings_of(values, part, cone, camera)
        if not found:
            continue  # seen from within its extension: only the ends have a contour
        z = rng.uniform(-1, 1) * BODY.shapes[part].half_axes[2]
        yield values, part, cone, camera, found[int(rng.integers(2))], z
        n -= 1


def cone_pose(values, part):
    """T_world_cone: the cone's frame lies at the centre of the part's shape."""
    return BODY.kinematics(values).Ts_world_part[part] @ rigid.transform(t=BODY.centers_part[part])


def rulings_of(values, part, cone, camera):
    T = cone_pose(values, part)
    return cone.rulings(T[:3, :3].T @ (T[:3, 3] - camera.center_world))


def image_at(values, part, cone, camera, near, z):
    """Image of the contour point at height z on the ruling nearest to an angle, at another pose."""
    found = np.array(rulings_of(values, part, cone, camera))
    theta = found[np.argmin(np.abs(np.angle(np.exp(1j * (found - near)))))]
    T = cone_pose(values, part)
    return project(camera, T[:3, :3] @ cone.point(theta, z) + T[:3, 3])


@pytest.mark.parametrize("block", [0, *(pytest.param(b, marks=pytest.mark.slow) for b in (1, 2, 3))])
def test_extremal_contours_move_as_their_jacobian_says(block):
    """Eq. 55 against central differences, to a relative 1e-5 in 1,000 well-conditioned cases; none of them is flagged.

    The contour generator is found again at every pose, so that it slides as the pose changes.
    """
    reference, rng, done = ZeroReference(BODY, np.zeros(6)), np.random.default_rng(block), 0
    for values, part, cone, camera, theta, z in cases(300, block):
        r = ruling(cone, cone_pose(values, part), camera, theta, z)
        if r.conditioning < 5 * SINGULAR:
            continue
        assert not r.singular
        direction, h = rng.normal(size=BODY.n_dofs), 2e-6
        J = r.J_I @ (r.A + r.B) @ reference.J_H(values, part)
        up, down = (image_at(BODY.retract(values, s * direction), part, cone, camera, theta, z) for s in (h, -h))
        numeric = (up - down) / (2 * h)
        assert np.linalg.norm(J @ direction - numeric) <= 1e-5 * np.linalg.norm(numeric)
        done += 1
    assert done >= 250


@pytest.mark.slow
def test_sliding_does_not_move_a_contour_across_itself():
    """The tangent plane holds the line of sight: along the contour's normal the sliding motion is zero to 1e-9."""
    flagged = 0
    for values, part, cone, camera, theta, z in cases(1000, 9):
        r = ruling(cone, cone_pose(values, part), camera, theta, z)
        sliding = r.J_I @ r.B
        assert np.abs(r.normal_px @ sliding).max() <= 1e-9 * max(np.abs(sliding).max(), 1.0)
        assert np.abs(sliding).max() > 1e-3  # but it does slide along itself
        flagged += r.singular
    assert flagged <= 20  # near-singular rulings are rare


def test_near_singular_rulings_are_finite_flagged_and_downweighted():
    """From where the two rulings meet, the sliding speed would grow without bound."""
    cone, z = Cone(0.05, 0.08, 0.4), 0.1
    slides = []
    for gap in (0.5, 1e-2, 1e-4, 1e-8, 1e-14):
        # The eye stands on the normal through a surface point, at a distance `gap` from the surface.
        X, n = cone.point(0.3, z), cone.normal(0.3)
        eye = X + gap * n / np.linalg.norm(n)
        camera = camera_at("near", eye, X + cone.ruling(0.3))
        found = cone.rulings(-eye)
        assert len(found) == 2
        r = ruling(cone, np.eye(4), camera, found[0], 3.0)
        assert np.all(np.isfinite(r.B))
        assert r.singular == (r.conditioning < SINGULAR)
        slides.append((r.conditioning, r.singular, float(np.abs(r.B).max())))
    conditioning, singular, speed = zip(*slides, strict=True)
    assert list(singular) == [False, *singular[1:]]
    assert all(singular[-3:])
    assert list(conditioning) == sorted(conditioning, reverse=True)
    assert max(speed[-2:]) < 0.1 * speed[0]  # its weight falls to nothing


def test_without_rulings_within_the_extension_of_a_cone():
    assert Cone(0.05, 0.08, 0.4).rulings(np.array([0.0, 0.0, -1.0])) == ()


def row_of_kernels(part, values, camera, point_world, normal_px, x, slope=None):
    """Derivative of the contour's motion along its normal by the degrees of freedom, (n_dofs,), by the kernels.

    With `slope`, (2,), it is the motion along that image gradient, sliding included.
    """
    kinematics, surfaces = BODY.kinematics(values), surfaces_of((BODY,))
    n = len(BODY.parts)
    M, b = np.zeros((n, 6, 6)), np.zeros((n, 6))
    W = kinematics.Ts_world_part[part][:3].copy()
    W[:, 3] = cone_pose(values, part)[:3, 3]
    W[:, :3] *= surfaces.half_axes[part]
    unit = np.linalg.solve(W[:, :3], point_world - W[:, 3])
    pieces = np.array([*x, 1.0, *normal_px, *unit], np.float32)[:, None]
    pulls = np.array([1.0, 1.0, 0, 0, 0, 0, 0])[:, None]  # one residual across the piece, of value 1
    if slope is not None:
        u, v = slope
        pulls = np.array([0, 0, u * u, u * v, v * v, u, v])[:, None]
    span, slides = np.array([0, 1]), slope is not None
    add_twists(span, pieces, pulls, camera.projection, W, camera.center_world, slides, M[part], b[part])
    gradient, hessian = np.empty(BODY.n_dofs), np.empty((BODY.n_dofs, BODY.n_dofs))
    twists_to_dofs(
        M, b, kinematics.axes_world, kinematics.origins_world, BODY.dof_is_length, BODY.dof_joint, BODY.tree.parents,
        BODY.moves, gradient, hessian,
    )  # fmt: skip
    return gradient, hessian


@pytest.mark.slow
def test_kernels_agree_with_the_reference():
    """The rows that the kernels sum are normal . J_I (A + B) J_H of Eq. 55, to 1e-3."""
    reference = ZeroReference(BODY, np.zeros(6))
    for values, part, cone, camera, theta, z in cases(200, 21):
        r = ruling(cone, cone_pose(values, part), camera, theta, z)
        row = r.normal_px @ r.J_I @ (r.A + r.B) @ reference.J_H(values, part)
        gradient, hessian = row_of_kernels(part, values, camera, r.point_world, r.normal_px, r.x)
        np.testing.assert_allclose(gradient, row, atol=1e-3 * np.abs(row).max())
        np.testing.assert_allclose(hessian, np.outer(row, row), atol=1e-3 * np.abs(row).max() ** 2)


@pytest.mark.slow
def test_the_kernel_of_the_sliding_term_agrees_with_the_reference():
    """The rows that the kernel sums are dD/dx . J_I (A + B) J_H of Eq. 55 for any slope of the distance, to 1e-3."""
    reference, rng, slides = ZeroReference(BODY, np.zeros(6)), np.random.default_rng(5), 0
    for values, part, cone, camera, theta, z in cases(200, 22):
        r, slope = ruling(cone, cone_pose(values, part), camera, theta, 0.99 * z), rng.normal(size=2)
        row = slope @ r.J_I @ (r.A + r.B) @ reference.J_H(values, part)
        rigid_row = slope @ r.J_I @ r.A @ reference.J_H(values, part)
        gradient, hessian = row_of_kernels(part, values, camera, r.point_world, r.normal_px, r.x, slope)
        np.testing.assert_allclose(gradient, row, atol=1e-3 * np.abs(row).max())
        np.testing.assert_allclose(hessian, np.outer(row, row), atol=1e-3 * np.abs(row).max() ** 2)
        slides += np.abs(row - rigid_row).max() > 0.01 * np.abs(row).max()
    assert slides > 100


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
        values = posed(BODY, seed)
        for camera in cameras_around(3):
            contours = trace([PosedBody(BODY, values)], camera)
            for part in range(len(BODY.parts)):
                cone, T = Cone.of(BODY.shapes[part]), cone_pose(values, part)
                own = rigid.apply(rigid.inverse(T), contours.points_world[contours.parts == part].astype(float))
                side = np.abs(own[:, 2]) < 0.999 * BODY.shapes[part].half_axes[2]
                angles = rulings_of(values, part, cone, camera)
                if not angles:
                    assert not side.any()
                    continue
                px = camera.project(rigid.apply(T, own[side]))
                off = []
                for theta in angles:
                    r = ruling(cone, T, camera, theta, 0.0)
                    off.append(np.abs((px - r.x) @ r.normal_px))
                if side.any():
                    assert np.min(off, axis=0).max() < 0.15
                    on_ruling += int(side.sum())
    assert on_ruling > 1000


@pytest.mark.parametrize("where", ["inside the extension", "end on", "inside the part", "behind the camera"])
def test_degenerate_views_give_finite_normal_equations(where):
    """Where a cone shows its end alone, or nothing, its residuals are finite; what is behind a camera has none."""
    body = PosedBody(BODY, posed(BODY, 3))
    T = cone_pose(body.values, BODY.part_index["left_thigh"])
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


def test_the_distance_image_and_its_gradient():
    """Eq. 59 and its corrected gradient, away from pixel borders, against central differences and the kernel."""
    rng = np.random.default_rng(4)
    image = rng.uniform(0, 20, (30, 40))
    flat = image.astype(np.float32).ravel()
    for _ in range(1000):
        x = rng.integers(0, [38, 28]) + rng.uniform(0.01, 0.99, 2)
        D, gradient = distance(image, x)
        numeric = [(distance(image, x + h)[0] - distance(image, x - h)[0]) / 2e-4 for h in 1e-4 * np.eye(2)]
        np.testing.assert_allclose(gradient, numeric, atol=1e-5 * 20)
        np.testing.assert_allclose(
            bilinear(flat, 40, 30, np.float32(x[0]), np.float32(x[1])), [D, *gradient], atol=1e-3
        )
