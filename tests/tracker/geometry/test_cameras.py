import cv2
import numpy as np
import pytest

from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.cameras import NEAR_PLANE_M, Camera, project_with_jacobian, viewed_point
from tracker.geometry.framing import epipolar_segment

K = np.array([[600.0, 0.0, 315.3], [0.0, 610.0, 244.7], [0.0, 0.0, 1.0]])
DISTORTIONS = {
    0: [],
    4: [-0.2, 0.05, 0.001, -0.002],
    5: [-0.2, 0.05, 0.001, -0.002, 0.01],
    8: [0.3, 0.1, 0.001, -0.002, 0.02, 0.5, 0.1, 0.03],
}
counts = pytest.mark.parametrize("count", DISTORTIONS)


def looking_at(position, target, up=(0.0, 0.0, 1.0), **changes):
    """A camera at a position that looks at a target."""
    z = np.subtract(target, position) / np.linalg.norm(np.subtract(target, position))
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    T_world_camera = rigid.transform(np.stack([x, np.cross(z, x), z], axis=1), np.array(position, dtype=float))
    settings = {"name": "cam", "size": (640, 480), "K": K, "distortion": np.zeros(0)}
    return Camera(T_world_camera=T_world_camera, **(settings | changes))


def camera(count=5):
    return looking_at((3.0, 1.0, 1.5), (0.0, 0.2, 1.0), distortion=np.array(DISTORTIONS[count], dtype=float))


def cloud(n=200):
    """Points around the origin that the camera has in view."""
    return np.random.default_rng(0).normal((0.0, 0.2, 1.0), 0.4, (n, 3))


def pixels(n=200):
    return np.random.default_rng(1).uniform((0, 0), (639, 479), (n, 2))


@counts
def test_project_as_opencv_does(count):
    c, points = camera(count), cloud()
    R, t = c.T_camera_world[:3, :3], c.T_camera_world[:3, 3]
    expected, _ = cv2.projectPoints(points, cv2.Rodrigues(R)[0], t, K, c.distortion if count else None)
    np.testing.assert_allclose(c.project(points), expected.reshape(-1, 2), atol=1e-9)


def test_behind_the_camera_is_nowhere():
    c = camera()
    behind = c.center_world - c.T_world_camera[:3, 2]
    assert np.isnan(c.project(np.stack([behind, [0.0, 0.2, 1.0]]))).tolist() == [[True, True], [False, False]]


@counts
def test_back_project_undoes_project(count):
    c, points = camera(count), cloud()
    np.testing.assert_allclose(c.back_project(c.project(points), c.depths(points)), points, atol=1e-8)


@counts
def test_rays_go_through_the_points(count):
    c, points = camera(count), cloud()
    rays = c.rays(c.project(points))
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1)
    along = points - c.center_world
    np.testing.assert_allclose(rays, along / np.linalg.norm(along, axis=-1, keepdims=True), atol=1e-9)


@counts
def test_undistorted_pixels_are_the_pinholes(count):
    c, points = camera(count), cloud()
    np.testing.assert_allclose(c.undistort_points(c.project(points)), c.pinhole.project(points), atol=1e-6)
    np.testing.assert_allclose(c.distort_points(c.undistort_points(pixels())), pixels(), atol=1e-6)
    assert c.pinhole.is_pinhole
    assert c.is_pinhole == (count == 0)


@counts
def test_undistorted_image_shows_each_point_where_the_pinhole_sees_it(count):
    c = camera(count)
    # Brightness tells where in the original image a pixel comes from.
    for axis, step in ((1, 0.3), (0, 0.4)):
        ramp = np.arange(640 if axis == 1 else 480) * step
        image = np.broadcast_to(ramp if axis == 1 else ramp[:, None], (480, 640)).astype(np.uint8)
        undistorted = c.undistort_image(np.ascontiguousarray(image))
        grid = np.stack(np.meshgrid(np.arange(100, 540, 20), np.arange(80, 400, 20)), axis=-1).reshape(-1, 2)
        source = c.distort_points(grid.astype(float))
        expected = source[:, 1 - axis] * step
        assert np.abs(undistorted[grid[:, 1], grid[:, 0]] - expected).max() < 1.5


def test_cropped_camera_counts_pixels_from_the_corner_of_the_region():
    c, points = camera(), cloud()
    part = c.cropped((100, 40, 300, 390))
    assert part.size == (200, 350)
    np.testing.assert_allclose(part.project(points), c.project(points) - (100, 40), atol=1e-9)
    np.testing.assert_allclose(part.rays(np.array([7.0, 9.0])), c.rays(np.array([107.0, 49.0])), atol=1e-9)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_scaled_camera_is_that_of_the_resized_image(scale):
    c, points = camera(), cloud()
    small = c.scaled(scale)
    assert small.size == (640 * scale, 480 * scale)
    # Areas of pixels stay aligned: the corner of the image, at -1/2, stays where it is.
    np.testing.assert_allclose(small.project(points) + 0.5, (c.project(points) + 0.5) * scale, atol=1e-9)
    dot = np.zeros((480, 640), np.float32)
    dot[200:204, 300:304] = 1.0
    resized = cv2.resize(dot, small.size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    ys, xs = np.nonzero(resized > 0.5)
    np.testing.assert_allclose([xs.mean() + 0.5, ys.mean() + 0.5], [302 * scale, 202 * scale])


def test_batches_keep_their_shape():
    c, points = camera(), cloud(24).reshape(2, 3, 4, 3)
    assert c.project(points).shape == (2, 3, 4, 2)
    assert c.rays(c.project(points)).shape == (2, 3, 4, 3)
    np.testing.assert_array_equal(c.project(points)[1, 2, 3], c.project(points[1, 2, 3]))
    assert c.undistort_points(np.zeros((0, 2))).shape == (0, 2)


@pytest.mark.parametrize("count", [1, 3, 6, 12])
def test_odd_numbers_of_coefficients(count):
    with pytest.raises(CalibrationError, match=f"0, 4, 5 or 8 distortion coefficients, found {count}"):
        looking_at((3.0, 0.0, 1.0), (0.0, 0.0, 1.0), distortion=np.zeros(count))


PAIRS = {
    "side by side": (looking_at((3, -1, 1.5), (0, 0, 1)), looking_at((3, 1, 1.2), (0, 0, 1))),
    "across": (looking_at((3, 0, 1.5), (0, 0, 1)), looking_at((0, 3, 1.2), (0, 0, 1))),
    "face to face": (looking_at((3, 0.2, 1.1), (0, 0, 1)), looking_at((-3, -0.1, 1.0), (0, 0, 1))),
    "one before the other": (looking_at((1, 0.2, 1.1), (-3, 0, 1)), looking_at((4, 0, 1), (0, 0, 1))),
    "one behind the other": (looking_at((4, 0, 1), (0, 0, 1)), looking_at((1, 0.2, 1.1), (-3, 0, 1))),
    "back to back": (looking_at((1, 0, 1), (5, 0, 1)), looking_at((-1, 0, 1), (-5, 0.5, 1))),
    "parallel": (looking_at((3, 0, 1), (0, 0, 1)), looking_at((3, 0.5, 1), (0, 0.5, 1))),
}


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS)
def test_epipolar_segment_is_where_the_ray_is_seen(pair):
    source, target = PAIRS[pair]
    seen_somewhere = 0
    for pixel in pixels(30):
        segment = epipolar_segment(source, target, pixel)
        # The ray itself, densely: from a tenth of a millimetre to ten kilometres.
        depths = np.geomspace(1e-4, 1e4, 8_000)
        points = source.center_world + depths[:, None] * source.rays(pixel)
        points = points[target.depths(points) > 0.1]
        seen = target.project(points)
        # Pixel centres lie at integers, so the image reaches half a pixel beyond them.
        inside = (seen > -0.5).all(axis=-1) & (seen < np.array(target.size) - 0.5).all(axis=-1)
        if not inside.any():
            # It may still cut a corner between two samples.
            assert segment is None or np.linalg.norm(segment[1] - segment[0]) < 15
            continue
        seen_somewhere += 1
        sampling = np.linalg.norm(np.diff(seen, axis=0), axis=-1)[inside[1:] | inside[:-1]].max()
        seen = seen[inside]
        assert segment is not None
        assert segment.shape == (2, 2)
        along = (segment[1] - segment[0]) / np.linalg.norm(segment[1] - segment[0])
        offset = seen - segment[0]
        across = offset[:, 0] * along[1] - offset[:, 1] * along[0]
        assert np.abs(across).max() < 1e-4
        # The segment holds all of the seen ray, and ends about where that ends.
        position, length = offset @ along, np.linalg.norm(segment[1] - segment[0])
        assert position.min() > -1e-4
        assert position.max() < length + 1e-4
        assert max(position.min(), length - position.max()) <= sampling + 0.1  # the last 0.1 lies beyond 10 km
        # Nearer parts of the ray come first.
        assert position[0] <= position[-1]
    assert seen_somewhere > 5 or pair == "back to back"


def test_epipolar_segment_of_distorted_cameras_lives_in_undistorted_pixels():
    distortion = np.array(DISTORTIONS[8])
    source = looking_at((3, -1, 1.5), (0, 0, 1), distortion=distortion)
    target = looking_at((3, 1, 1.2), (0, 0, 1), distortion=distortion)
    point = np.array([0.1, 0.2, 0.9])
    start, end = epipolar_segment(source, target, source.pinhole.project(point))
    seen = target.pinhole.project(point)
    assert abs(np.cross([*(end - start), 0], [*(seen - start), 0])[2]) / np.linalg.norm(end - start) < 1e-6


def test_no_epipolar_segment_where_the_ray_leaves_the_view():
    source, target = PAIRS["back to back"]
    assert epipolar_segment(source, target, np.array([320.0, 240.0])) is None


def test_the_viewed_point_is_where_the_axes_meet():
    target = (0.3, -0.2, 1.1)
    cameras = [looking_at(p, target) for p in ((3.0, 1.0, 1.5), (-2.0, 2.5, 2.0), (0.5, -3.0, 0.4))]
    np.testing.assert_allclose(viewed_point(cameras), target, atol=2e-3)


def test_one_camera_alone_looks_at_what_is_some_metres_ahead():
    alone = looking_at((3.0, 1.0, 1.5), (0.0, 0.2, 1.0))
    point = viewed_point([alone])
    assert alone.depths(point) == pytest.approx(4.0, abs=0.05)
    np.testing.assert_allclose(alone.project(point), K[:2, 2], atol=1e-6)


def test_jacobian_of_the_projection_against_finite_differences():
    c, points, h = camera(5), cloud(), 1e-6
    points_px, J = c.project_with_jacobian(points)
    np.testing.assert_allclose(points_px, c.pinhole.project(points), atol=1e-9)
    for axis, step in enumerate(h * np.eye(3)):
        slope = (c.pinhole.project(points + step) - c.pinhole.project(points - step)) / (2 * h)
        np.testing.assert_allclose(J[:, :, axis], slope, rtol=1e-5, atol=1e-4)


def test_a_point_behind_the_near_plane_is_projected_from_the_near_plane():
    c = camera(0)
    along = c.T_world_camera[:3, :3] @ np.array([[0.01, 0.02, d] for d in (0.03, NEAR_PLANE_M - 1e-9, -2.0)]).T
    points_px, J = c.project_with_jacobian(c.center_world + along.T)
    np.testing.assert_allclose(points_px, np.tile(points_px[0], (3, 1)))
    np.testing.assert_allclose(J @ c.T_world_camera[:3, 2], 0.0, atol=1e-9)


def test_cameras_of_the_points_are_projected_one_by_one():
    cameras = [camera(0), looking_at((-2.0, 2.0, 1.0), (0.0, 0.0, 1.0))]
    points = cloud(2)
    Ts_camera_world, K = np.stack([c.T_camera_world for c in cameras]), np.stack([c.K for c in cameras])
    points_px, J = project_with_jacobian(Ts_camera_world, K, points)
    for c, point, px, by_point in zip(cameras, points, points_px, J, strict=True):
        one_px, one_J = c.project_with_jacobian(point[None])
        np.testing.assert_allclose(one_px[0], px)
        np.testing.assert_allclose(one_J[0], by_point)


@pytest.mark.parametrize(
    ("distortion", "radius"),
    [((-0.3, 0.0, 0.0, 0.0), np.sqrt(1 / 0.9)), ((0.1, 0.0, 0.0, 0.0), np.inf), ((-0.2, 0.05, 0.0, 0.0), np.inf)],
)
def test_the_lens_shows_points_up_to_where_its_polynomial_turns(distortion, radius):
    K = np.array([[500.0, 0.0, 319.5], [0.0, 480.0, 239.5], [0.0, 0.0, 1.0]])
    camera = Camera("c", (640, 480), K, np.array(distortion), np.eye(4))
    reach = np.array([0.1, 0.99 * radius, 1.01 * radius, 5.0] if np.isfinite(radius) else [0.1, 5.0, 15.0, 19.0])
    for axis in ((1.0, 0.0), (0.0, -1.0), (0.6, 0.8)):
        px = K[[0, 1], [0, 1]] * reach[:, None] * axis + K[:2, 2]
        expected = reach < radius
        assert camera.within_lens(px).tolist() == expected.tolist()
    assert not camera.within_lens(np.array([np.nan, 3.0]))
    assert camera.pinhole.within_lens(np.array([[1e5, 3.0], [np.nan, 3.0]])).tolist() == [True, False]
