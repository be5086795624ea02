"""Notice two cameras whose footage is exchanged: the foregrounds of all views must be pictures of one scene.

The visual hull of the foregrounds is carved from a grid of points in small pictures, and projected back. With the right
assignment it covers the foregrounds; with two videos exchanged it covers less. Only exchanges of two cameras are tried:
a ring of cameras assigned in another rotation gives the same hull.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording, read_background, read_mask
from tracker.geometry.arrays import Array, Image, Mask
from tracker.geometry.cameras import BEYOND_PX, NEAR_PLANE_M, Camera, viewed_point

_SIDE_PX = 128
"""Longer side of the pictures."""
_FRAMES = (4, 6)
"""Numbers of frames that are compared, with backgrounds and without. Then their median is an empty scene where
nobody stays half of the time."""
_MIN_DIFFERENCE = 20.0
"""Smallest difference from the background that counts as a change, gray levels."""
_MIN_MASK_PX = 20
"""Smallest foreground that counts, px of a small picture: less is noise."""
_MAX_FOREGROUND = 0.6
"""Share of a picture above which its background is that of another place, and says nothing."""
_COARSE, _FINE = 20, 30
"""Points of the grids along each axis: of the whole room, and around what the coarse one finds."""
_ROOM = 0.7
"""Half the side of the room, as a share of the cameras' mean distance from the point at which they look."""


class _Least(NamedTuple):
    """Coverage with two cameras exchanged from which the exchange is reported."""

    gain: float
    """Above the coverage of the assignment."""
    coverage: float
    """In all."""


_REPORTED = _Least(gain=0.1, coverage=0.45)
"""On seven recordings, with four cameras
and with three of them, no right assignment is reported. Of 38 exchanges of two of four cameras with backgrounds, 36 are
named; of the two others, in a square, the pair across is named."""
_PRESENCE = (0.4, 0.6)
"""Shares of a body's points on the foreground: below the first it is not there, and above the second it is."""
_MAX_CAMERAS = 8
"""Among more cameras only those with the least coverage are exchanged."""


class CameraExchange(NamedTuple):
    """Two cameras whose footage fits better the other way round."""

    cameras: tuple[str, str]
    coverage: float
    """Share of the foreground that the hull covers, 0 to 1."""
    exchanged_coverage: float
    """The same with the footage of the two exchanged."""
    with_backgrounds: bool
    """Whether the backgrounds go with the footage: the calibration, not the footage, has the two names exchanged."""

    @property
    def text(self) -> str:
        """A sentence for the user."""
        a, b = self.cameras
        return (
            f"the footage of '{a}' and '{b}' seems to be exchanged: a body in one place explains "
            f"{100 * self.coverage:.0f}% of what moves in the views, and {100 * self.exchanged_coverage:.0f}% with the "
            "two exchanged; check which file is of which camera"
        )


def find_exchange(cameras: Sequence[CameraSource], recording: Recording) -> CameraExchange | None:
    """Return the exchange of two cameras that fits clearly better than the assignment; None if there is none.

    Raises:
        RecordingError: footage, a background or a mask cannot be read.
    """
    if len(cameras) < 2:
        return None
    views = [_SmallView(c.camera) for c in cameras]
    n_with, n_without = _FRAMES
    n = n_with if all(c.background or c.masks for c in cameras) else n_without
    footage = _read(cameras, views, recording, recording.quick_frames(n))
    order = list(range(len(cameras)))
    room, foregrounds = _Room(views), [f.foregrounds for f in footage]
    coverage = _coverage(room, foregrounds)
    candidates = sorted(order, key=lambda i: coverage[i])[:_MAX_CAMERAS]
    found = []
    for i, j in combinations(sorted(candidates), 2):
        if cameras[i].camera.size == cameras[j].camera.size:
            exchanges = _exchanged((views[i], footage[i]), (views[j], footage[j]))
            for n_stay, (of_i, of_j) in enumerate(exchanges):
                exchanged = [of_i if k == i else of_j if k == j else foregrounds[k] for k in order]
                found.append((float(_coverage(room, exchanged).mean()), n_stay == 0, i, j))
    before = float(coverage.mean())
    best, with_backgrounds, i, j = max(found, default=(0.0, False, 0, 0))
    if best < max(before + _REPORTED.gain, _REPORTED.coverage):
        return None
    return CameraExchange((cameras[i].camera.name, cameras[j].camera.name), before, best, with_backgrounds)


def find_body_exchange(
    cameras: Sequence[CameraSource], recording: Recording, frame: int, points_world: Array
) -> tuple[str, str] | None:
    """Return two cameras in whose views a body is not on the foreground, and is with the two exchanged; else None.

    Only views with a background or a mask count, because one frame shows no motion.

    Args:
        cameras: the views.
        recording: their footage.
        frame: the frame of the pose.
        points_world: points of the body, (N, 3), metres.

    Raises:
        RecordingError: footage, a background or a mask cannot be read.
    """
    views = [_SmallView(c.camera) for c in cameras]
    footage = _read(cameras, views, recording, [frame])

    def share(camera: int, mask: Mask | None) -> float:
        if mask is None or mask.mean() > _MAX_FOREGROUND:
            return 0.0
        pixels, inside = views[camera].pixels(points_world)
        return float((inside & mask.ravel()[pixels]).mean())

    known = [i for i, c in enumerate(cameras) if c.background or c.masks]
    for i, j in combinations(known, 2):
        if cameras[i].camera.size != cameras[j].camera.size:
            continue
        now = max(share(k, footage[k].foregrounds[0]) for k in (i, j))
        for of_i, of_j in _exchanged((views[i], footage[i]), (views[j], footage[j])):
            there = min(share(i, of_i[0]), share(j, of_j[0]))
            absent, present = _PRESENCE
            if now < absent and there > present:
                return cameras[i].camera.name, cameras[j].camera.name
    return None


class _SmallView:
    """One camera in small pictures without lens distortion."""

    def __init__(self, camera: Camera) -> None:
        self.source = camera
        self.camera = camera.pinhole.scaled(_SIDE_PX / max(camera.size))
        self._P = self.camera.projection.astype(np.float32)

    def image(self, image: Image) -> NDArray[np.float32]:
        """Return a frame as filmed, small, (h, w, 3)."""
        small = cv2.resize(self.source.undistort_image(image), self.camera.size, interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.float32)

    def pixels(self, points_world: Array) -> tuple[NDArray[np.intp], Mask]:
        """Return the index of the pixel of each point, (N,), and whether it is in the picture."""
        # Written out, in single precision: this takes most of the time.
        u, v, w = self._P[:, :3] @ points_world.T.astype(np.float32) + self._P[:, 3:]
        w = np.where(w > NEAR_PLANE_M, w, np.float32(np.nan))
        with np.errstate(invalid="ignore"):
            columns, rows = np.rint(u / w), np.rint(v / w)
            inside = (columns >= 0) & (rows >= 0) & (columns < self.camera.width) & (rows < self.camera.height)
        return np.where(inside, rows * self.camera.width + columns, 0).astype(np.intp), inside


class _Footage(NamedTuple):
    """Small pictures of one camera's footage, by frame, and what they are compared with."""

    images: list[NDArray[np.float32] | None]
    """None where a frame is damaged."""
    background: NDArray[np.float32] | None
    """The empty scene; None to compare with the median of the frames."""
    masks: list[Mask | None]
    """None where there is no mask."""

    foregrounds: list[Mask | None]
    """Pixels of each frame that differ from the background; None where it is damaged."""


def _foregrounds(
    images: Sequence[NDArray[np.float32] | None], background: NDArray[np.float32] | None, masks: list[Mask | None]
) -> list[Mask | None]:
    there = [image for image in images if image is not None]
    if not there:
        return masks
    empty = np.median(there, axis=0) if background is None else background
    changed = [None if image is None else _changed(image, empty) for image in images]
    return [c if m is None else m for c, m in zip(changed, masks, strict=True)]


def _read(
    cameras: Sequence[CameraSource], views: Sequence[_SmallView], recording: Recording, frames: Sequence[int]
) -> list[_Footage]:
    """Read some frames of all cameras in small pictures."""
    images: list[list[NDArray[np.float32] | None]] = [[] for _ in cameras]
    masks: list[list[Mask | None]] = [[] for _ in cameras]
    for k in frames:
        for i, (source, view, image) in enumerate(zip(cameras, views, recording.read(k), strict=True)):
            images[i].append(None if image is None else view.image(image))
            mask = read_mask(source, k)
            masks[i].append(None if mask is None else view.image(_gray(mask > 0))[..., 0] > 127)
    found = []
    for source, view, rows, some in zip(cameras, views, images, masks, strict=True):
        empty = read_background(source)
        background = None if empty is None else view.image(empty)
        found.append(_Footage(rows, background, some, _foregrounds(rows, background, some)))
    return found


def _gray(mask: Mask) -> Image:
    return np.repeat((mask * np.uint8(255))[..., None], 3, axis=2)


def _exchanged(
    first: tuple[_SmallView, _Footage], second: tuple[_SmallView, _Footage]
) -> list[tuple[list[Mask | None], list[Mask | None]]]:
    """Return the foregrounds of two cameras, by frame, with their footage exchanged.

    Args:
        first: one camera, and its footage.
        second: another one.

    Returns:
        The foregrounds of the one and of the other, with the backgrounds exchanged too (as where the calibration has
        the names exchanged), and with backgrounds that stay.
    """
    (one, own), (other, others) = first, second
    for_one, for_other = _through(one, other, others), _through(other, one, own)
    found = [(for_one.foregrounds, for_other.foregrounds)]
    if own.background is not None and others.background is not None:
        a, b = ((f.images, g.background, f.masks) for f, g in ((for_one, own), (for_other, others)))
        found.append((_foregrounds(*a), _foregrounds(*b)))
    return found


def _through(view: _SmallView, filmed: _SmallView, footage: _Footage) -> _Footage:
    """Return the footage of a camera, undistorted by the lens of another one.

    Common lenses are taken as alike. The undistorted pictures of fisheye lenses differ even in size.
    """
    if not (view.source.fisheye or filmed.source.fisheye):
        return footage
    original_px = np.stack(view.source.distortion_map(view.camera), axis=-1).astype(np.float64)
    share = np.array(filmed.camera.size) / filmed.source.pinhole.size
    at = (filmed.source.undistort_points(original_px) + 0.5) * share - 0.5
    columns, rows = np.moveaxis(
        np.nan_to_num(np.clip(at, BEYOND_PX, -BEYOND_PX), nan=BEYOND_PX).astype(np.float32), -1, 0
    )

    def image(found: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray(cv2.remap(found, columns, rows, cv2.INTER_LINEAR), np.float32)

    def mask(found: Mask) -> Mask:
        return np.asarray(cv2.remap(found.view(np.uint8), columns, rows, cv2.INTER_NEAREST)).view(np.bool_)

    return _Footage(
        [None if i is None else image(i) for i in footage.images],
        None if footage.background is None else image(footage.background),
        [None if m is None else mask(m) for m in footage.masks],
        [None if m is None else mask(m) for m in footage.foregrounds],
    )


def _changed(image: NDArray[np.float32], empty: NDArray[np.float32]) -> Mask:
    """Return where a picture differs from the empty scene, after its exposure is matched."""
    gain = np.median(image[::2, ::2] / (empty[::2, ::2] + 1), axis=(0, 1))
    red, green, blue = np.moveaxis(np.abs(image - gain * empty), -1, 0)
    difference = np.maximum(np.maximum(red, green), blue)  # ten times as fast as along the last axis
    changed = (difference > max(_MIN_DIFFERENCE, 6 * float(np.median(difference[::2, ::2])))).astype(np.uint8)
    changed = np.asarray(cv2.morphologyEx(changed, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)), np.uint8)
    return np.asarray(cv2.morphologyEx(changed, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))) > 0


class _Room:
    """A grid of points where the cameras look, with their pixels in every view."""

    def __init__(self, views: Sequence[_SmallView]) -> None:
        middle = viewed_point([v.camera for v in views])
        self.views = views
        self.distance = float(np.mean([np.linalg.norm(v.camera.center_world - middle) for v in views]))
        """Mean distance of the cameras from the middle, metres."""
        half = _ROOM * self.distance
        self.spacing = 2 * half / _COARSE
        self.points = _grid(middle - half, middle + half, _COARSE)
        self.pixels = [v.pixels(self.points) for v in views]


# --- the visual hull --------------------------------------------------------------------------------------------------


def _coverage(room: _Room, foregrounds: Sequence[list[Mask | None]]) -> Array:
    """Return the mean share of each camera's foreground that the hull covers, (n_cameras,).

    Args:
        room: the cameras.
        foregrounds: of the footage that is assigned to each, by frame.
    """
    shares = []
    for masks in zip(*foregrounds, strict=True):
        if sum(_is_useful(m) for m in masks) >= 2:
            shares.append(_covered_shares(room, masks))
    if not shares:
        return np.zeros(len(room.views))
    rows = np.array(shares)  # NaN where a view has no foreground
    counted = np.isfinite(rows)
    return np.where(counted, rows, 0).sum(axis=0) / np.maximum(counted.sum(axis=0), 1)


def _is_useful(mask: Mask | None) -> bool:
    return mask is not None and int(mask.sum()) >= _MIN_MASK_PX


def _covered_shares(room: _Room, masks: Sequence[Mask | None]) -> list[float]:
    """Return the share of each mask that the hull covers; NaN for a mask that is missing or almost empty."""
    hull = _carve(room.views, masks, room.pixels, room.spacing / room.distance)
    shares = [0.0 if _is_useful(m) else float("nan") for m in masks]
    if not hull.any():
        return shares
    found = room.points[hull]
    fine = _grid(found.min(axis=0) - room.spacing, found.max(axis=0) + room.spacing, _FINE)
    pixels = [v.pixels(fine) for v in room.views]
    hull = _carve(room.views, masks, pixels, 0.0)
    step = float(np.ptp(fine, axis=0).max()) / _FINE
    for i, (view, mask) in enumerate(zip(room.views, masks, strict=True)):
        if mask is None or np.isnan(shares[i]):
            continue
        shown = np.zeros(mask.shape, np.uint8)
        shown.ravel()[pixels[i][0][hull & pixels[i][1]]] = 1
        radius = int(np.ceil(view.camera.K[0, 0] * step / room.distance / 2))
        shown = np.asarray(cv2.morphologyEx(shown, cv2.MORPH_CLOSE, _square(radius)), np.uint8)
        shares[i] = float((shown.astype(bool) & mask).sum() / mask.sum())
    return shares


def _carve(
    views: Sequence[_SmallView],
    masks: Sequence[Mask | None],
    pixels: Sequence[tuple[NDArray[np.intp], Mask]],
    spacing_rad: float,
) -> Mask:
    """Return which points lie on the foreground in every view that sees them, and are seen by two or more, (N,).

    Args:
        views: the cameras.
        masks: the foreground in each.
        pixels: of the points in each view (`_SmallView.pixels`).
        spacing_rad: distance between points as the cameras see it, by which the masks are grown.
    """
    n = len(pixels[0][0])
    hull, n_seen = np.ones(n, dtype=bool), np.zeros(n, dtype=np.uint8)
    for view, mask, (at, inside) in zip(views, masks, pixels, strict=True):
        if mask is not None:
            radius = max(1, int(np.ceil(0.9 * view.camera.K[0, 0] * spacing_rad)))
            grown = np.asarray(cv2.dilate(mask.view(np.uint8), _square(radius))).astype(bool)
            hull &= ~inside | grown.ravel()[at]
            n_seen += inside
    return hull & (n_seen >= 2)


def _grid(low: Array, high: Array, n: int) -> Array:
    """Return the points of a grid in a box, (n^3, 3)."""
    axes = [np.linspace(a, b, n) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _square(radius: int) -> NDArray[np.uint8]:
    return np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
