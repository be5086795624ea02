"""A calibrated camera with OpenCV's models of projection and lens distortion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.lenses import distort_slopes, fisheye_directions, fisheye_limit, fisheye_project

MAX_LENS_RADIUS = 20.0
"""Tangent of the widest angle from the optical axis, 87 degrees, at which a lens is examined."""

BORDER_SAMPLES = 257
"""Points along each side of an image that its undistorted image is fitted to."""
BEYOND_PX = -32000.0
"""Column of what no lens shows, in maps of OpenCV, which are 16 bit wide."""

ROUNDING_PX2 = 1 / 12
"""Variance of rounding to whole pixels, px^2: that of a uniform distribution one pixel wide."""

Region = tuple[int, int, int, int]
"""A box in an image, px: first column, first row, column after the last, row after the last."""

MAX_PINHOLE_ANGLE = np.radians(70.0)
"""Largest angle from the axis that the undistorted picture of a fisheye lens is made to hold, rad. A picture without
distortion stretches along the radius by 1/cos^2: 8 times here, 15 times at 75 degrees, without end at 90."""
MAX_PINHOLE_GROWTH = 4.0
"""Largest number of undistorted pixels per pixel of a fisheye's footage: twice as many along either side."""

NEAR_PLANE_M = 0.05
"""Depth of the near plane, metres: nothing closer to a camera is drawn or matched."""


def coefficient_counts(fisheye: bool) -> tuple[int, ...]:
    """Return how many coefficients a lens model takes; 0 leaves out all terms."""
    return (0, 4) if fisheye else (0, 4, 5, 8)


def count_words(fisheye: bool) -> str:
    """Return the numbers of coefficients in words, for messages."""
    return "0 or 4 fisheye" if fisheye else "0, 4, 5 or 8"


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera.

    Pixel centres lie at integers; axes are OpenCV's (x right, y down, z forward). *Original* pixels are those
    of the footage as filmed. *Undistorted* pixels are those of `pinhole`, the same camera without lens distortion;
    everything is drawn and matched in them. The undistorted picture of a fisheye lens is larger than the footage.
    """

    name: str
    """Name by which footage and people refer to the camera."""
    size: tuple[int, int]
    """Image width and height, px."""
    K: Array
    """Pinhole matrix, (3, 3), px."""
    distortion: Array
    """OpenCV coefficients k1, k2, p1, p2[, k3[, k4, k5, k6]]; (0,), (4,), (5,) or (8,). A fisheye lens has
    k1, k2, k3, k4 of the equidistant model, or none; (0,) or (4,)."""
    T_world_camera: Array
    """Pose, (4, 4), metres: maps camera coordinates to world coordinates."""
    fisheye: bool = False
    """Whether the lens follows OpenCV's equidistant model (`cv2.fisheye`), otherwise Brown and Conrady's."""

    def __post_init__(self) -> None:
        if self.distortion.shape not in [(n,) for n in coefficient_counts(self.fisheye)]:
            raise CalibrationError(
                f"camera '{self.name}': expected {count_words(self.fisheye)} distortion coefficients, "
                f"found {self.distortion.size}; correct 'distortions' in the calibration file"
            )
        assert self.K.shape == (3, 3)
        assert self.T_world_camera.shape == (4, 4)

    @property
    def width(self) -> int:
        """Image width, px."""
        return self.size[0]

    @property
    def height(self) -> int:
        """Image height, px."""
        return self.size[1]

    @cached_property
    def T_camera_world(self) -> Array:
        """Inverse pose, (4, 4): maps world coordinates to camera coordinates."""
        return rigid.inverse(self.T_world_camera)

    @cached_property
    def projection(self) -> Array:
        """Projection matrix, (3, 4): maps homogeneous world points to homogeneous undistorted pixels."""
        return self.pinhole.K @ self.T_camera_world[:3]

    @cached_property
    def center_world(self) -> Array:
        """Optical centre in the world, (3,), metres."""
        return self.T_world_camera[:3, 3].copy()

    @property
    def is_pinhole(self) -> bool:
        """Whether there is no lens distortion, so that original and undistorted pixels coincide."""
        return not self.fisheye and not np.any(self.distortion)

    @cached_property
    def pinhole(self) -> "Camera":
        """The same camera without lens distortion: the camera of undistorted pixels.

        For a fisheye lens, its image holds the footage up to `MAX_PINHOLE_ANGLE` from the axis, at the focal lengths of
        `K`, so that the middle keeps its resolution. An image of more than `MAX_PINHOLE_GROWTH` times the footage's
        pixels is reduced to that.
        """
        if self.fisheye:
            return self._fisheye_pinhole()
        return self if self.is_pinhole else replace(self, distortion=np.zeros(0))

    def _fisheye_pinhole(self) -> "Camera":
        xy = self._px_to_slopes(_border(self.size))
        directions = fisheye_directions(xy, self.distortion)
        angles = np.arctan2(np.linalg.norm(directions[:, :2], axis=-1), directions[:, 2])
        widest = min(MAX_PINHOLE_ANGLE, fisheye_limit(self.distortion))
        slopes = np.tan(np.where(angles < widest, angles, widest))  # NaN is beyond the lens
        lengths = np.maximum(np.linalg.norm(xy, axis=-1, keepdims=True), TINY)  # 0 at the principal point
        border_px = self._slopes_to_px(xy / lengths * slopes[:, None])
        low, high = np.floor(border_px.min(axis=0)), np.ceil(border_px.max(axis=0))
        width, height = (int(n) + 1 for n in high - low)
        K = self.K.copy()
        K[:2, 2] -= low
        whole = replace(self, size=(width, height), K=K, distortion=np.zeros(0), fisheye=False)
        most = MAX_PINHOLE_GROWTH * self.width * self.height
        return whole if width * height <= most else whole.scaled(float(np.sqrt(most / (width * height))))

    def scaled(self, scale: float) -> "Camera":
        """Return the camera of the image resized by `scale`, pixel areas (not centres) kept aligned."""
        size = (round(self.width * scale), round(self.height * scale))
        # OpenCV's resize keeps pixel borders aligned: u' + 1/2 = s (u + 1/2), with centres at integers. Here s is the
        # ratio of the rounded sizes.
        s = np.array([size[0] / self.width, size[1] / self.height])
        K = self.K.copy()
        K[:2] *= s[:, None]
        K[:2, 2] += (s - 1.0) / 2.0
        return replace(self, size=size, K=K)

    def cropped(self, region: Region) -> "Camera":
        """Return the camera of a region cut out of the image: the same rays, pixels counted from its corner."""
        u0, v0, u1, v1 = region
        assert u0 < u1, region
        assert v0 < v1, region
        K = self.K.copy()
        K[:2, 2] -= (u0, v0)
        return replace(self, size=(u1 - u0, v1 - v0), K=K)

    def depths(self, points_world: Array) -> Array:
        """Return distances along the optical axis, `(..., 3)` to `(...)`, metres; positive in front of the camera."""
        return rigid.apply(self.T_camera_world, points_world)[..., 2]

    def project(self, points_world: Array) -> Array:
        """Project world points `(..., 3)` to original pixels `(..., 2)`; NaN behind the camera.

        A fisheye lens may see points beside and behind the camera; NaN where its model ends.
        """
        return self._directions_to_px(rigid.apply(self.T_camera_world, np.asarray(points_world, dtype=np.float64)))

    def project_with_depths(self, points_world: Array) -> tuple[Array, Array]:
        """Return `project` and `depths` of world points, `(..., 3)`, as `(..., 2)` and `(...)`."""
        directions = rigid.apply(self.T_camera_world, points_world)
        return self._directions_to_px(directions), directions[..., 2]

    def project_with_jacobian(self, points_world: Array) -> tuple[Array, Array]:
        """Project world points `(N, 3)` to undistorted pixels, with derivatives, as the function of this name does."""
        return project_with_jacobian(self.T_camera_world, self.pinhole.K, points_world)

    def rays(self, points_px: Array) -> Array:
        """Return unit directions in the world, `(..., 3)`, of the viewing rays of original pixels `(..., 2)`.

        The rays start at `center_world`. NaN for pixels that a fisheye lens leaves black.
        """
        directions_camera = self._px_to_directions(np.asarray(points_px, dtype=np.float64))
        directions_camera /= np.linalg.norm(directions_camera, axis=-1, keepdims=True)
        return directions_camera @ self.T_world_camera[:3, :3].T

    def back_project(self, points_px: Array, depths_m: Array | float) -> Array:
        """Return world points `(..., 3)` seen at original pixels `(..., 2)` at the given depths (see `depths`).

        NaN where the ray never has that depth, as that of a fisheye beyond 90 degrees, which has negative depths only.
        """
        directions = self._px_to_directions(np.asarray(points_px, dtype=np.float64))
        z = directions[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = np.where((z > 0) | (depths_m < 0), depths_m / z, np.nan)
        return rigid.apply(self.T_world_camera, directions * lengths[..., None])

    def undistort_points(self, points_px: Array) -> Array:
        """Map original pixels `(..., 2)` to undistorted pixels; NaN where a fisheye sees 90 degrees aside or more."""
        points = np.asarray(points_px, dtype=np.float64)
        return points if self.is_pinhole else self.pinhole._directions_to_px(self._px_to_directions(points))

    def distort_points(self, points_px: Array) -> Array:
        """Map undistorted pixels `(..., 2)` to original pixels; NaN where the model of a fisheye ends."""
        points = np.asarray(points_px, dtype=np.float64)
        return points if self.is_pinhole else self._directions_to_px(self.pinhole._px_to_directions(points))

    def within_lens(self, points_px: Array) -> NDArray[np.bool_]:
        """Return whether undistorted pixels, `(..., 2)`, lie where the model of the distortion holds; False for NaN.

        Farther out, the polynomial bends back: it maps points that no lens shows to pixels within the image.
        """
        if self.is_pinhole:
            return np.asarray(np.isfinite(points_px).all(axis=-1))
        radius = np.linalg.norm(self.pinhole._px_to_slopes(points_px), axis=-1)
        return np.asarray(radius < self._lens_radius)

    def is_filmed(self, points_px: Array) -> NDArray[np.bool_]:
        """Return whether undistorted pixels, `(..., 2)`, show footage; those in the corners of a fisheye's may not."""
        original = self.distort_points(points_px)
        with np.errstate(invalid="ignore"):
            inside = np.all((original >= -0.5) & (original <= np.array(self.size) - 0.5), axis=-1)
        return np.asarray(inside & self.within_lens(points_px))

    @cached_property
    def _lens_radius(self) -> float:
        """Distance from the axis, at depth 1, up to which the distorted distance grows; infinite if it always does."""
        if self.fisheye:
            limit = fisheye_limit(self.distortion)
            return float(np.tan(limit)) if limit < np.pi / 2 else np.inf
        radii = np.linspace(0.0, MAX_LENS_RADIUS, 4001)
        points = np.stack([radii, np.zeros_like(radii)], axis=-1)
        steps = np.diff(self._slopes_to_px(distort_slopes(points, self.distortion))[:, 0])
        falls = np.flatnonzero(steps <= 0)
        return float(radii[falls[0]]) if len(falls) else np.inf

    def undistort_image(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Resample an image as filmed, `(H, W[, C])`, to the undistorted pixels of `pinhole`; black beyond it."""
        assert image.shape[:2] == (self.height, self.width), (image.shape, self.size)
        if self.is_pinhole:
            return image
        return np.asarray(cv2.remap(image, *self._undistort_maps, cv2.INTER_LINEAR), dtype=np.uint8)

    @cached_property
    def _undistort_maps(self) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
        whole, fractions = cv2.convertMaps(*self.distortion_map(self.pinhole), cv2.CV_16SC2)
        return np.asarray(whole, dtype=np.int16), np.asarray(fractions, dtype=np.uint16)

    def distortion_map(self, view: "Camera") -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the original pixel of each pixel of a view without distortion, columns and rows, (H, W) each.

        Args:
            view: `pinhole`, scaled or cropped.
        """
        assert view.is_pinhole
        if not self.fisheye:
            found = cv2.initUndistortRectifyMap(self.K, self.distortion, np.eye(3), view.K, view.size, cv2.CV_32FC1)
            return np.asarray(found[0], dtype=np.float32), np.asarray(found[1], dtype=np.float32)
        k = np.pad(self.distortion, (0, 4 - self.distortion.size))
        columns, rows = cv2.fisheye.initUndistortRectifyMap(self.K, k, np.eye(3), view.K, view.size, cv2.CV_32FC1)
        # OpenCV leaves out the skew here.
        columns += np.float32(self.K[0, 1] / self.K[1, 1]) * (rows - np.float32(self.K[1, 2]))
        if np.isfinite(self._lens_radius):
            grid = np.stack(np.meshgrid(np.arange(view.width), np.arange(view.height)), axis=-1)
            radii = np.linalg.norm(view._px_to_slopes(grid.astype(np.float64)), axis=-1)
            columns[radii >= self._lens_radius] = BEYOND_PX
        return np.asarray(columns, dtype=np.float32), np.asarray(rows, dtype=np.float32)

    def _directions_to_px(self, directions: Array) -> Array:
        """Map directions in camera coordinates, (..., 3), of any length to original pixels, (..., 2)."""
        if self.fisheye:
            return self._slopes_to_px(fisheye_project(directions, self.distortion))
        z = directions[..., 2:]
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = np.where(z > TINY, directions[..., :2] / z, np.nan)
        return self._slopes_to_px(xy if self.is_pinhole else distort_slopes(xy, self.distortion))

    def _px_to_directions(self, points_px: Array) -> Array:
        """Map original pixels, (..., 2), to directions in camera coordinates, (..., 3), of no particular length."""
        xy = self._px_to_slopes(points_px)
        if self.fisheye:
            return fisheye_directions(xy, self.distortion)
        if not self.is_pinhole and xy.size:
            criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
            flat = points_px.reshape(-1, 1, 2)
            out = cv2.undistortPoints(flat, self.K, self.distortion, criteria=criteria)
            xy = np.asarray(out, dtype=np.float64).reshape(points_px.shape)
        return np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1)

    def _slopes_to_px(self, xy: Array) -> Array:
        """Apply `K` to slopes, (..., 2), distorted ones if the camera has a lens."""
        u = self.K[0, 0] * xy[..., 0] + self.K[0, 1] * xy[..., 1] + self.K[0, 2]
        return np.stack([u, self.K[1, 1] * xy[..., 1] + self.K[1, 2]], axis=-1)

    def _px_to_slopes(self, points_px: Array) -> Array:
        """Apply the inverse of `K` to pixels, (..., 2)."""
        y = (points_px[..., 1] - self.K[1, 2]) / self.K[1, 1]
        x = (points_px[..., 0] - self.K[0, 2] - self.K[0, 1] * y) / self.K[0, 0]
        return np.stack([x, y], axis=-1)


def _border(size: tuple[int, int]) -> Array:
    """Return points along the border of an image, (n, 2), px."""
    low, (right, bottom) = -0.5, np.array(size) - 0.5
    u, v = np.linspace(low, right, BORDER_SAMPLES), np.linspace(low, bottom, BORDER_SAMPLES)
    sides = ((u, low), (u, bottom), (low, v), (right, v))
    return np.concatenate([np.stack(np.broadcast_arrays(a, b), axis=-1) for a, b in sides])


def project_with_jacobian(Ts_camera_world: Array, K: Array, points_world: Array) -> tuple[Array, Array]:
    """Project points to undistorted pixels and differentiate the pixels by the points.

    A depth below `NEAR_PLANE_M` is replaced by `NEAR_PLANE_M`, with derivative 0, so that the pixel stays finite.

    Args:
        Ts_camera_world: inverse pose of one camera, (4, 4), or of each point's camera, (N, 4, 4).
        K: pinhole matrix of one camera, (3, 3), or of each point's camera, (N, 3, 3), px.
        points_world: (N, 3), metres.

    Returns:
        Undistorted pixels, (N, 2), and their derivatives by the points, (N, 2, 3), px per metre.
    """
    R, focal = Ts_camera_world[..., :3, :3], K[..., :2, :2]
    points_camera = (R @ points_world[:, :, None])[..., 0] + Ts_camera_world[..., :3, 3]
    depths = points_camera[:, 2:]
    z = np.maximum(depths, NEAR_PLANE_M)
    slopes = points_camera[:, :2] / z
    z_by_point = (depths >= NEAR_PLANE_M) * R[..., 2, :]
    slopes_by_point = (R[..., :2, :] - slopes[:, :, None] * z_by_point[:, None]) / z[:, :, None]
    return (focal @ slopes[:, :, None])[..., 0] + K[..., :2, 2], focal @ slopes_by_point


def projections(cameras: Sequence[Camera]) -> tuple[Array, Array]:
    """Return the projection matrices of cameras, (V, 3, 4), and their optical centres in the world, (V, 3), metres."""
    return np.stack([c.projection for c in cameras]), np.stack([c.center_world for c in cameras])


def px_per_m(cameras: Sequence[Camera], point_world: Array) -> float:
    """Return the length of a metre at a point, (3,), in undistorted images, px: the median over the cameras."""
    return float(np.median([c.K[0, 0] / max(c.depths(point_world), NEAR_PLANE_M) for c in cameras]))


def viewed_point(cameras: Sequence[Camera]) -> Array:
    """Return the point nearest to all optical axes in the least squares sense, (3,), metres.

    For one camera, or parallel ones, the depth is undetermined; the point is then 4 m in front of the first.
    """
    axes, centers = np.stack([c.T_world_camera[:3, 2] for c in cameras]), np.stack([c.center_world for c in cameras])
    A, b = across_lines(centers, axes)
    front = centers[0] + 4.0 * axes[0]
    return np.linalg.solve(A + 1e-3 * np.eye(3), b + 1e-3 * front)


def across_lines(points: Array, directions: Array) -> tuple[Array, Array]:
    """Return A, (3, 3), and b, (3,), with A x = b for the point x nearest to lines in the least squares sense.

    Args:
        points: one of each line, (n, 3).
        directions: unit vectors along them, (n, 3).
    """
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    return across.sum(axis=0), (across @ points[..., None]).sum(axis=0)[:, 0]
