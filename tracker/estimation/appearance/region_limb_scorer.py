"""Score one limb in hundreds of poses by region evidence, with all other parts static."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import chain_poses
from tracker.body.model import PosedBody, ahead, parts_of
from tracker.estimation.appearance.part_drawing import Canvas, draw, meshes_of
from tracker.estimation.appearance.region_kernels import LimbCanvas, LimbImages, add_limb_scores, fill_limb_images
from tracker.estimation.appearance.region_model import RegionFrame, RegionModel, sample_share
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.geometry.arrays import Array, IntArray


class _View(NamedTuple):
    """A view in which the limb moves."""

    ahead_frames: float
    """Frames by which the picture was taken later than the frame."""
    P: Array
    """Projection matrix to cells, (3, 4)."""
    share: float
    """See `sample_share`."""
    images: LimbImages
    """The rest of the bodies, and the evidence for the limb."""


class RegionLimbScorer:
    """Scores one limb of an otherwise static body, in each view at the time of its picture. Thread-safe."""

    def __init__(
        self, known: RegionModel, frame: RegionFrame, bodies: Sequence[PosedBody], person: int, limb: IntArray
    ) -> None:
        """Draw the static parts.

        Args:
            known: the appearance of all people.
            frame: the frame.
            bodies: all people; the limb may be anywhere.
            person: index of the person.
            limb: indices of the limb's parts in their body, from the trunk outwards, (n,).
        """
        self._body, self._limb = bodies[person], limb
        parts = parts_of([b.model for b in bodies], person).start + limb
        meshes = meshes_of(tuple(b.model for b in bodies))
        self._points, self._faces = meshes.points[parts], meshes.faces
        static = np.setdiff1d(np.arange(len(meshes.points)), parts)
        self._views = []
        for i, view in enumerate(frame.views):
            if view is None:
                continue
            shape, P = view.colors.shape[:2], view.camera.projection
            Ts = part_poses(ahead(bodies, view.ahead_frames))
            canvas = draw(meshes._replace(points=meshes.points[static]), P, Ts[static], *shape)
            labels = np.append(0, static + 1).astype(np.uint8)[canvas.labels]
            nats, trust = np.empty(shape, np.float32), np.empty((len(limb), *shape), np.float32)
            images = LimbImages(Canvas(canvas.nearness, labels), nats, trust)
            share = sample_share(view.camera)
            fill_limb_images(view.colors, share, frame.background[i], known.by_view[i], parts, images)
            self._views.append(_View(view.ahead_frames, P, share, images))
        self.static_nats = float(sum(v.images.static_nats.sum() for v in self._views))
        """Evidence for all bodies without the limb, nats."""

    def __call__(self, poses: Array) -> Array:
        """Return what the limb adds to the evidence in many poses, (C, n_values), that differ in the limb only, (C,),
        nats.

        Of a cell that the limb hides, the evidence for the part behind it is subtracted.
        """
        Ts = {time: self._placed(poses, time) for time in {v.ahead_frames for v in self._views}}
        nats, corners = np.zeros(len(poses)), np.empty((self._points.shape[2], 3), np.float32)
        for time, P, share, images in self._views:
            shape, to_px = images.static_nats.shape, (P @ Ts[time]).astype(np.float32)
            canvas = LimbCanvas(np.empty(shape, np.float32), np.empty(shape, np.float32), np.zeros(shape, np.int32))
            add_limb_scores(self._points, self._faces, to_px, share, images, canvas, corners, nats)
        return nats

    def _placed(self, poses: Array, ahead_frames: float) -> Array:
        """Return the poses of the limb's parts some frames later, (C, n, 4, 4), metres."""
        rest = self._body.ahead(ahead_frames).kinematics
        return chain_poses(self._body.model.tree, rest, self._limb, self._body.poses_ahead(poses, ahead_frames))
