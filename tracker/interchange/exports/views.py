"""The views of an export: their cameras in its pixels, their pictures, and the people in them, as points and labels."""

from collections.abc import Generator, Sequence
from contextlib import closing, contextmanager
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody, ahead
from tracker.errors import RecordingError
from tracker.evidence.contours.label_image import part_labels
from tracker.files import write_text_atomic
from tracker.formats.anipose import format_calibration
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import BEYOND_PX, MAX_PINHOLE_ANGLE, Camera
from tracker.geometry.lens_tables import lens_of, undistortion_map
from tracker.interchange.exports.faces import recording_of
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.keypoints import Keypoints, keypoints_in_views
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, PersonMotion

CALIBRATION = "calibration.toml"
"""Name of the file of the cameras beside labels in undistorted pixels."""
IMAGES = "images"
"""Name of the folder of the pictures, with one of each camera."""


def exported_cameras(motion: ExportedMotion, options: ExportOptions) -> tuple[Camera, ...]:
    """Return the cameras of all views in the pixels of an export."""
    cameras = (c.camera for c in motion.session.cameras)
    return tuple(c.pinhole if options.pixels == "undistorted" else c for c in cameras)


class Pictures:
    """Writes the pictures of frames to a folder: `images/CAMERA/000012.jpg` for frame 12 of the footage."""

    def __init__(self, motion: ExportedMotion, options: ExportOptions, cameras: Sequence[Camera], folder: Path) -> None:
        """Open the footage.

        Args:
            motion: what is exported.
            options: of the export.
            cameras: in the pixels of the pictures.
            folder: in which `images` appears.

        Raises:
            TrackerError: the footage cannot be read, or its faces cannot be blurred.
        """
        self._sources, self._cameras, self._folder = motion.session.cameras, cameras, folder
        self._recording = recording_of(motion, options.faces)
        for camera in cameras:
            (folder / IMAGES / camera.name).mkdir(parents=True)

    def write(self, view: int, frame: int) -> bool:
        """Write the picture of a view; False if the frame is damaged, and left out.

        Raises:
            RecordingError: the footage cannot be read.
            OSError: the picture cannot be written.
        """
        source, camera = self._sources[view], self._cameras[view]
        picture = self._recording.read_view(view, frame)
        if picture is None:
            return False
        if camera.is_pinhole and not source.camera.is_pinhole:
            picture = source.camera.undistort_image(picture)
        path = self._folder / IMAGES / camera.name / f"{frame + source.offset:06d}.jpg"
        coded, data = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        if not coded:
            raise RecordingError(f"camera '{camera.name}': expected a picture of frame {frame}, found none to encode")
        path.write_bytes(data.tobytes())
        return True

    def close(self) -> None:
        """Close the footage."""
        self._recording.close()


@contextmanager
def undistorted_pictures(
    motion: ExportedMotion, options: ExportOptions, folder: Path
) -> Generator[Pictures | None, None, None]:
    """Write the cameras of undistorted pixels, and yield the writer of such pictures; None in original pixels.

    Raises:
        RecordingError: the footage cannot be read.
        OSError: the cameras cannot be written.
    """
    if options.pixels == "original":
        yield None
        return
    cameras = exported_cameras(motion, options)
    write_text_atomic(folder / CALIBRATION, format_calibration(cameras))
    with closing(Pictures(motion, options, cameras, folder)) as pictures:
        yield pictures


def view_labels(bodies: Sequence[PosedBody], camera: Camera) -> NDArray[np.uint8]:
    """Label the pixels of a view that bodies cover, lens distortion included.

    Args:
        bodies: all bodies in the scene; at most 255 parts in all.
        camera: of the view.

    Returns:
        (H, W): 1 + the index of the visible part, counted through all bodies; 0 for none, and for pixels of a fisheye
        that have no undistorted ones.
    """
    if camera.is_pinhole:
        return part_labels(bodies, camera)
    columns, rows = undistortion_map(lens_of(camera))
    wide = _wide_pinhole(camera, columns, rows)
    shift = (wide.K - camera.pinhole.K)[:2, 2].astype(np.float32)
    labels = part_labels(bodies, wide)
    found = cv2.remap(labels, columns + shift[0], rows + shift[1], cv2.INTER_NEAREST)
    return np.asarray(found, dtype=np.uint8)


def _wide_pinhole(camera: Camera, columns: NDArray[np.float32], rows: NDArray[np.float32]) -> Camera:
    """Return the camera without distortion whose picture holds all that the lens films, up to the widest angle."""
    pinhole = camera.pinhole
    if camera.fisheye:
        return pinhole
    known = columns != BEYOND_PX
    reach = np.tan(MAX_PINHOLE_ANGLE) * pinhole.K[(0, 1), (0, 1)]
    center = pinhole.K[:2, 2]
    low = [max(float(x[known].min()), c - r) for x, c, r in zip((columns, rows), center, reach, strict=True)]
    high = [min(float(x[known].max()), c + r) for x, c, r in zip((columns, rows), center, reach, strict=True)]
    (u0, v0), (u1, v1) = np.floor(low).astype(int).tolist(), (np.ceil(high).astype(int) + 1).tolist()
    return pinhole.cropped((u0, v0, u1, v1))


class PersonInView(NamedTuple):
    """A person whose pose is exported in a view."""

    person: PersonMotion
    body: PosedBody
    """At the time of the picture."""
    keypoints: Keypoints


class FrameViews:
    """The people of a frame in all views."""

    def __init__(self, motion: ExportedMotion, cameras: Sequence[Camera], frame: int) -> None:
        """Take the frame.

        Args:
            motion: what is exported.
            cameras: of all views, in the pixels of the export.
            frame: of the session.
        """
        self._motion, self._cameras, self._frame = motion, cameras, frame
        self._people = motion.bodies(frame)
        self._times = [source.clock.offset_frames(frame) for source in motion.session.cameras]

    def bodies(self, view: int) -> Sequence[PosedBody]:
        """Return the bodies of all people in the scene at the time of the picture."""
        return ahead([body for _, body in self._people], self._times[view])

    @cached_property
    def _keypoints(self) -> list[list[Keypoints]]:
        if not self._people:
            return [[] for _ in self._cameras]
        return keypoints_in_views([body for _, body in self._people], self._cameras, self._times)

    def seen(self, view: int) -> list[PersonInView]:
        """Return the people whose pose is exported and whose body is in the picture."""
        rows = zip(self._people, self.bodies(view), self._keypoints[view], strict=True)
        return [
            PersonInView(person, body, keypoints)
            for (person, _), body, keypoints in rows
            if self._motion.is_exported(person, self._frame) and keypoints.box_px is not None
        ]

    def labels(self, view: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Label the pixels of a picture.

        Returns:
            The person in each pixel, (H, W), as an index into the session's people, -1 for none; and the part of that
            person's body, (H, W), -1 for none.
        """
        bodies = self.bodies(view)
        counts = [len(body.model.parts) for body in bodies]
        people = np.repeat([person.index for person, _ in self._people], counts)
        parts = np.concatenate([np.arange(n) for n in counts]) if counts else np.zeros(0, np.int64)
        found = view_labels(bodies, self._cameras[view])
        return np.append(-1, people).astype(np.int64)[found], np.append(-1, parts).astype(np.int64)[found]


class ViewPoints(NamedTuple):
    """The points of F frames, P people and n points in V views."""

    points_px: Array
    """Joint centres, (V, F, P, n, 2), in the pixels of the export; NaN outside the picture, and without a pose."""
    visibility: NDArray[np.uint8]
    """A `KeypointFlag` of each, (V, F, P, n)."""


def view_arrays(motion: ExportedMotion, options: ExportOptions, points: tuple[str, ...], tick: Tick) -> ViewPoints:
    """Return the points of all exported people in all views.

    Args:
        motion: what is exported.
        options: its pixels.
        points: names of the points, (n,).
        tick: called after each frame.
    """
    cameras = exported_cameras(motion, options)
    shape = (len(cameras), len(motion.frames), len(motion.chosen), len(points))
    out = ViewPoints(np.full((*shape, 2), np.nan), np.zeros(shape, np.uint8))
    for i, frame in enumerate(motion.frames):
        views = FrameViews(motion, cameras, frame)
        for view in range(len(cameras)):
            for person, body, keypoints in views.seen(view):
                is_in = keypoints.visibility > 0
                columns = np.array([points.index(name) for name in body.model.point_names])[is_in]
                at = view, i, motion.chosen.index(person.index)
                out.points_px[at][columns] = keypoints.points_px[is_in]
                out.visibility[at][columns] = keypoints.visibility[is_in]
        tick()
    return out
