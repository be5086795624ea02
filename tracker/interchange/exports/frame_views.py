"""The people of a frame in each view: their points, also as arrays of all frames, and the pixels that they cover."""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody, ahead
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.export_format import Tick
from tracker.interchange.exports.keypoints import Keypoints, keypoints_in_views
from tracker.interchange.exports.motion import ExportedMotion, PersonMotion
from tracker.interchange.exports.options import ExportOptions
from tracker.interchange.exports.views import exported_cameras, view_labels


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
