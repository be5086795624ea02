"""One view of a frame made ready, then of a region its smoothed image, and what in it is new."""

from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import read_background, read_mask
from tracker.geometry.arrays import FloatArray, Image
from tracker.geometry.cameras import Region
from tracker.images import background_subtraction
from tracker.images.background_subtraction import Changes
from tracker.images.image_statistics import ImageStatistics, SampleGrid
from tracker.images.working_view import WorkingView


class Prepared(NamedTuple):
    """A view of a frame, and what of it does not depend on a region."""

    frame: Image
    """As filmed, (H, W, 3) RGB."""
    mask: NDArray[np.uint8] | None
    """As filmed, (H, W); None where there is none."""
    strengths: FloatArray
    """Strengths of the gradient all over the image, which set the thresholds of edges, (n,)."""
    threshold: float
    """Difference from the background that is a change, gray levels."""
    gain: FloatArray
    """How much brighter than the background the camera shows each channel, (3,)."""


class _Empty(NamedTuple):
    """The empty scene of a view."""

    smooth: Image
    """Smoothed, in working pixels, (H, W, 3)."""
    statistics: ImageStatistics
    """What the probes show of it."""
    usable: NDArray[np.intp]
    """Which of them tell the exposure, (m,)."""


class Foreground:
    """What is new in the frames of one view. Safe to use from several threads."""

    def __init__(self, source: CameraSource, executor: Executor) -> None:
        """Read the background.

        Args:
            source: the view, with its side files.
            executor: where the empty scene is made meanwhile: the first kernel of a program takes a third of a second
                to load.

        Raises:
            RecordingError: the background is missing, unreadable or of the wrong size.
        """
        self.view = WorkingView(source.camera)
        """The way from footage to working pixels."""
        self._source, self._grid = source, SampleGrid(source.camera.size, self.view.scale)
        self._empty = executor.submit(self._empty_scene, read_background(source))

    def prepare(self, frame: Image, k: int) -> Prepared:
        """Do with frame k, as filmed, what needs no region.

        Raises:
            RecordingError: its mask cannot be used.
        """
        empty, mask = self._empty.result(), read_mask(self._source, k)
        statistics = self._grid.measure(frame)
        if empty is None:
            return Prepared(frame, mask, statistics.strengths, 0.0, np.ones(3, np.float32))
        gain = background_subtraction.exposure_gain(
            statistics.colors[empty.usable], empty.statistics.colors[empty.usable]
        )
        differences = np.abs(statistics.colors - gain * empty.statistics.colors).max(axis=-1)
        return Prepared(frame, mask, statistics.strengths, background_subtraction.change_threshold(differences), gain)

    def smoothed(self, prepared: Prepared, box: Region) -> Image:
        """A region of the frame, smoothed, in working pixels, (H, W, 3)."""
        return background_subtraction.smoothed(self.view.image(prepared.frame, box))

    def changes(self, prepared: Prepared, smooth: Image, box: Region) -> Changes | None:
        """What is new in a region, whose smoothed image is given, by its mask or before its background.

        None where nothing tells it.
        """
        u0, v0, u1, v1 = box
        empty = self._empty.result()
        if prepared.mask is not None:
            inside = self.view.mask(prepared.mask, box)
            return Changes(inside, inside)
        if empty is None:
            return None
        background = background_subtraction.brightened(empty.smooth[v0:v1, u0:u1], prepared.gain)
        return background_subtraction.subtract_background(smooth, background, prepared.threshold)

    def _empty_scene(self, background: Image | None) -> _Empty | None:
        if background is None:
            return None
        smooth = background_subtraction.smoothed(self.view.image(background, self.view.whole))
        statistics = self._grid.measure(background)
        return _Empty(smooth, statistics, np.flatnonzero(background_subtraction.tells_exposure(statistics.colors)))
