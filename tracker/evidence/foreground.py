"""Prepare one view of a frame, then extract the features of a region: its foreground, edges and silhouette."""

import threading
from collections.abc import Sequence
from concurrent.futures import Executor, Future
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.evidence.images import background_subtraction
from tracker.evidence.images.background_subtraction import Changes
from tracker.evidence.images.edge_segments import link_and_sample
from tracker.evidence.images.edges import ImageStatistics, SampleGrid, detect_edges, levels
from tracker.evidence.images.working_view import WorkingView, fit_region
from tracker.evidence.view_evidence import EdgeSettings, RegionFeatures, silhouette_evidence
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import parts_of_mask
from tracker.footage.recording import read_background, read_mask
from tracker.geometry.arrays import FloatArray, Image
from tracker.geometry.cameras import Region

FOREGROUND_MARGIN = 0.012
"""Width of the margin around the silhouette in which edges count, as a fraction of the longer side of the image."""


class Prepared(NamedTuple):
    """One view of a frame, with the measurements that depend on no region."""

    frame: Image
    """As filmed, (H, W, 3) RGB."""
    mask: NDArray[np.uint8] | None
    """As filmed, (H, W); None without a mask."""
    strengths: FloatArray
    """Gradient strengths over the whole image, from which the edge thresholds follow, (n,)."""
    threshold: float
    """Difference from the background above which a pixel has changed, gray levels."""
    gain: FloatArray
    """Gain of each channel over the background, (3,)."""


class _Empty(NamedTuple):
    """The empty scene of a view."""

    smooth: Image
    """Smoothed image, in working pixels, (H, W, 3)."""
    statistics: ImageStatistics
    """Measurements at the sample grid."""


class Foreground:
    """The foreground of one view. Thread-safe."""

    def __init__(self, source: CameraSource, executor: Executor) -> None:
        """Read the background.

        Args:
            source: the view, with its side files.
            executor: pool in which the empty scene is measured.

        Raises:
            RecordingError: the background is missing, unreadable or of the wrong size.
        """
        self.view = WorkingView(source.camera)
        """Conversion of footage to working pixels."""
        self._source, self._grid = source, SampleGrid(source.camera.size, self.view.scale)
        self._executor, self._background = executor, read_background(source)
        self._measuring: Future[_Empty | None] | None = None
        self._lock = threading.Lock()

    def of(self, source: CameraSource) -> "Foreground":
        """Return the foreground of the same view with another clock or other masks.

        The background is read again where it or the calibration is another; see `__init__`.
        """
        if (source.camera, source.background) != (self._source.camera, self._source.background):
            return Foreground(source, self._executor)
        other = copy(self)
        other._source = source
        return other

    def measure_empty_scene(self) -> Future[_Empty | None]:
        """Begin to measure the empty scene, at the first call.

        Not when the view is opened: the first kernel of a program takes long to load, or even to compile.
        """
        with self._lock:
            if self._measuring is None:
                self._measuring = self._executor.submit(self._empty_scene, self._background)
                self._background = None
            return self._measuring

    def empty_scene(self) -> Image | None:
        """Return the smoothed empty scene in working pixels, (H, W, 3); None without a background."""
        empty = self.measure_empty_scene().result()
        return None if empty is None else empty.smooth

    def prepare(self, frame: Image, k: int) -> Prepared:
        """Prepare frame k, as filmed, as far as no region is needed.

        Raises:
            RecordingError: its mask cannot be used.
        """
        empty, mask = self.measure_empty_scene().result(), read_mask(self._source, k)
        statistics = self._grid.measure(frame)
        if empty is None:
            return Prepared(frame, mask, statistics.strengths, 0.0, np.ones(3, np.float32))
        gain, threshold = background_subtraction.exposure_and_threshold(statistics.colors, empty.statistics.colors)
        return Prepared(frame, mask, statistics.strengths, threshold, gain)

    def box(self, region: Region | None) -> Region:
        """Return a region within the image, working px; the whole image for None."""
        return self.view.whole if region is None else fit_region(region, self.view.camera.size)

    def features(
        self, prepared: Prepared | None, region: Region | None, with_static_edges: bool, settings: EdgeSettings
    ) -> RegionFeatures:
        """Return the features of a region, working px, or of the whole image (None); without edges where the frame is
        damaged (None)."""
        box, scale, filmed = self.box(region), self.view.scale, self.view.filmed
        camera = self.view.camera.cropped(box)
        if prepared is None:
            nothing = np.zeros((camera.height, camera.width), np.uint8)
            return RegionFeatures(camera, scale, box[:2], filmed.size, nothing)
        smooth = background_subtraction.smooth_image(self.view.image(prepared.frame, box))
        changes = self._changes(prepared, smooth, box) if settings.foreground else None
        margin_px = FOREGROUND_MARGIN * max(filmed.size)
        foreground = None if changes is None else background_subtraction.dilate(changes.anything, margin_px)
        shown = self.view.shown
        if shown is not None:
            u0, v0, u1, v1 = box
            part = np.ascontiguousarray(shown[v0:v1, u0:u1])
            foreground = part if foreground is None else foreground & part
        # The model of static edges refuses texture, so low thresholds can keep the weaker edges of bodies.
        is_restricted = changes is not None or with_static_edges
        edges = detect_edges(smooth, levels(prepared.strengths, is_restricted), foreground)
        segments, samples = link_and_sample(edges.found, edges.gradients, settings.max_segment_px)
        silhouette = None if changes is None else silhouette_evidence(changes, edges, filmed.size)
        return RegionFeatures(camera, scale, box[:2], filmed.size, edges.found, segments, samples, smooth, silhouette)

    def _changes(self, prepared: Prepared, smooth: Image, box: Region) -> Changes | None:
        """Return the foreground of a region by its mask, else by its background; None without either.

        Args:
            prepared: the view.
            smooth: smoothed image of the region.
            box: the region, working px.
        """
        u0, v0, u1, v1 = box
        empty = self.measure_empty_scene().result()
        if prepared.mask is not None:
            people, unknown = parts_of_mask(prepared.mask)
            inside = self.view.mask(people, box)
            if unknown is None:
                return Changes(inside, inside)
            unsure = self.view.mask(unknown, box)
            return Changes(inside, inside | unsure, unsure)
        if empty is None:
            return None
        background = background_subtraction.apply_gain(empty.smooth[v0:v1, u0:u1], prepared.gain)
        return background_subtraction.subtract_background(smooth, background, prepared.threshold)

    def _empty_scene(self, background: Image | None) -> _Empty | None:
        if background is None:
            return None
        smooth = background_subtraction.smooth_image(self.view.image(background, self.view.whole))
        return _Empty(smooth, self._grid.measure(background))


def prepare_views(
    views: Sequence[Foreground], frames: Sequence[Image | None], shown: Sequence[int]
) -> list[Prepared | None]:
    """Prepare the frame that each view shows, as filmed, (H, W, 3); None where it is damaged.

    Raises:
        RecordingError: a mask cannot be used.
    """
    for view in views:  # those of all views at the same time
        view.measure_empty_scene()
    return [None if f is None else view.prepare(f, k) for view, f, k in zip(views, frames, shown, strict=True)]
