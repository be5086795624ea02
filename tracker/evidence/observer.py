"""Compute the evidence of the frames of a recording.

The observer processes only the requested regions, several views at a time and one frame ahead. It decodes the next
frame. If that frame's regions are known in time, it also extracts the features that do not depend on the prediction.
"""

import threading
from collections import OrderedDict
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from tracker.evidence.foreground import Foreground, Prepared, prepare_views
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.keypoints import KeypointEvidence
from tracker.evidence.view_evidence import DEFAULT_EDGES, EdgeSettings, RegionFeatures, ViewEvidence, select_evidence
from tracker.footage.camera_source import CameraSource, ahead_frames
from tracker.footage.recording import Recording
from tracker.geometry.arrays import FloatArray, Image
from tracker.geometry.cameras import Camera, Region

FRAMES_AHEAD = 2
"""Frames that are read ahead, each by a thread of its own."""


class _Ahead(NamedTuple):
    """A frame that is prefetched."""

    prepared: Future[list[Prepared | None]]
    """Each view; None where the frame is damaged."""
    features: Future[list[RegionFeatures]] | None = None
    """Features of a region of each view; None while no regions are known."""
    with_static_edges: bool = False
    """Whether static edges will be refused, which lowers the edge thresholds."""
    edges: EdgeSettings = DEFAULT_EDGES
    """Which edges are found."""


class Observer:
    """Computes evidence from the frames of a recording. Thread-safe."""

    def __init__(
        self, cameras: Sequence[CameraSource], recording: Recording, recording_views: Sequence[int] | None = None,
        views: Sequence[Foreground] | None = None, keypoints: KeypointEvidence | None = None,
        at_nearest_times: bool = False, origin: "Observer | None" = None,
    ) -> None:  # fmt: skip
        """Read the backgrounds.

        Args:
            cameras: the views, with their side files.
            recording: their footage.
            in_recording: index of each view in the recording, if it has others too.
            views: the foreground of each view, if another observer has read the backgrounds.
            keypoints: of all people in these views, if they are evidence, too.
            in_time: see `at_nearest_times`.
            origin: the observer that this one is made of; None if it is the first.

        Raises:
            RecordingError: a background is missing, unreadable or of the wrong size.
        """
        self.cameras = tuple(cameras)
        self.recording = recording
        """Footage of the views."""
        self.origin = origin or self
        """The observer of all cameras that this one was made of. Its pictures are those of the frames themselves."""
        self._in_recording, self.keypoints, self._is_in_time = recording_views, keypoints, at_nearest_times
        # OpenCV's own threads would compete with the threads of other views.
        self._pool, self._pool_ahead = (
            ThreadPoolExecutor(FRAMES_AHEAD, name, initializer=cv2.setNumThreads, initargs=(1,))
            for name in ("observe", "observe ahead")
        )
        self._views = [Foreground(c, self._pool) for c in self.cameras] if views is None else list(views)
        self._reader, self._finder = (ThreadPoolExecutor(1, name) for name in ("read ahead", "find ahead"))
        self._ahead: OrderedDict[int, _Ahead] = OrderedDict()
        self._lock = threading.Lock()

    def with_cameras(self, chosen: Sequence[int]) -> "Observer":
        """Return an observer of some of the views, by their indices, of the same footage."""
        return self._with(chosen, self.keypoints, self._is_in_time)

    def with_keypoints(self, keypoints: KeypointEvidence | None) -> "Observer":
        """Return an observer of the same views to which key points are evidence, too; None: to which they are not."""
        return self._with(range(len(self.cameras)), keypoints, self._is_in_time)

    def with_sources(self, cameras: Sequence[CameraSource]) -> "Observer":
        """Return an observer of the same cameras, all of them, with other calibrations, clocks and masks.

        Raises:
            RecordingError: a background cannot be read.
        """
        views = [view.of(source) for view, source in zip(self._views, cameras, strict=True)]
        return Observer(cameras, self.recording.with_cameras(cameras), None, views)

    def at_nearest_times(self) -> "Observer":
        """Return an observer of the same views that takes the picture of each that is nearest in time to the frame.

        Poses that follow one another are found by it: a motion is straight over half a frame, but not over several.
        """
        if self._is_in_time or all(c.clock.is_in_step(self.recording.n_frames) for c in self.cameras):
            return self
        return self._with(range(len(self.cameras)), self.keypoints, at_nearest_times=True)

    def _with(self, chosen: Sequence[int], keypoints: KeypointEvidence | None, at_nearest_times: bool) -> "Observer":
        """Return an observer of some of the views, with key points of all of them."""
        keypoints = None if keypoints is None else keypoints.of_views(chosen)
        cameras, recording_views = [self.cameras[i] for i in chosen], [self.recording_views[i] for i in chosen]
        views = [self._views[i] for i in chosen]
        return Observer(cameras, self.recording, recording_views, views, keypoints, at_nearest_times, self.origin)

    @property
    def recording_views(self) -> Sequence[int]:
        """Index of each view in the recording, (V,)."""
        return range(len(self.cameras)) if self._in_recording is None else self._in_recording

    @property
    def working_cameras(self) -> tuple[Camera, ...]:
        """Cameras of the whole views in working pixels: without lens distortion, at working scale."""
        return tuple(v.view.camera for v in self._views)

    def ahead_frames(self, k: int) -> tuple[float, ...]:
        """Return by how many frames the picture of each view was taken later than frame k; see `Clock`."""
        return ahead_frames(self.cameras, self._shown(k), k)

    def _shown(self, k: int) -> list[int]:
        """Return the frame whose picture each view has on frame k: k, or that of the nearest time."""
        if not self._is_in_time:
            return [k] * len(self.cameras)
        return [c.clock.nearest(k, self.recording.n_frames) for c in self.cameras]

    def empty_scenes(self) -> tuple[Image | None, ...]:
        """Return the smoothed empty scene of each view in working pixels, (H, W, 3); None without a background."""
        for view in self._views:  # those of all views at the same time
            view.measure_empty_scene()
        return tuple(view.empty_scene() for view in self._views)

    def prefetch(
        self,
        k: int,
        regions: Sequence[Region | None] | None = None,
        with_static_edges: bool = False,
        edges: EdgeSettings = DEFAULT_EDGES,
    ) -> None:
        """Begin to decode frame k and to extract its features; `evidence` uses the result.

        At most two frames are prefetched. Call again once the regions are known. A frame that cannot be read raises in
        `evidence`, not here.

        Args:
            k: frame number.
            regions: regions that `evidence` will be asked for, if known. Other regions are processed again, so that the
                result never depends on this hint.
            with_static_edges: whether `evidence` will be given static edges.
            edges: settings that `evidence` will be given.
        """
        with self._lock:
            ahead = self._ahead.get(k) or _Ahead(self._reader.submit(self._prepare, k))
            if regions is not None and ahead.features is None:
                ahead = ahead._replace(
                    features=self._finder.submit(
                        self._find_ahead, ahead.prepared, list(regions), with_static_edges, edges
                    ),
                    with_static_edges=with_static_edges,
                    edges=edges,
                )
            self._ahead[k] = ahead
            while len(self._ahead) > FRAMES_AHEAD:
                self._ahead.popitem(last=False)[1].prepared.cancel()

    def evidence(
        self,
        k: int,
        regions: Sequence[Region | None] | None = None,
        predicted_px: Sequence[FloatArray | None] | None = None,
        static_edges: Sequence[StaticEdgeModel] | None = None,
        edges: EdgeSettings = DEFAULT_EDGES,
    ) -> tuple[ViewEvidence, ...]:
        """Return the evidence of frame k in each view, restricted to the foreground where masks or a background exist.

        A damaged frame has no edges, so its view does not count in the cost.

        Args:
            k: frame number.
            regions: region of each view, working px, see `working_view.region_around`; None is the whole image.
            predicted_px: visible pieces of the predicted contours in each view, (M, 4), px of `working_cameras`, by
                which segments are accepted; None keeps all edges.
            static_edges: static edges of each view, refused where neither masks nor a background exist.
            edges: which edges are found and accepted. `regions` says where, also for whole images.
        """
        with self._lock:
            ahead = self._ahead.pop(k, None)
        prepared = self._prepare(k) if ahead is None else ahead.prepared.result()
        everywhere, with_static_edges, features = (
            [None] * len(self.cameras),
            static_edges is not None,
            list[RegionFeatures](),
        )
        asked = (with_static_edges, edges)
        if ahead is not None and ahead.features is not None and (ahead.with_static_edges, ahead.edges) == asked:
            features = ahead.features.result()

        shown, times = self._shown(k), self.ahead_frames(k)

        def observe(
            i: int, region: Region | None, predicted_px: FloatArray | None, model: StaticEdgeModel | None
        ) -> ViewEvidence:
            view = self._views[i]
            known = features and features[i].box == view.box(region)
            seen = features[i] if known else view.features(prepared[i], region, with_static_edges, edges)
            if predicted_px is not None:
                predicted_px = predicted_px - np.array([*seen.corner_px, *seen.corner_px], np.float32)
            model = model if seen.silhouette is None else None
            found = select_evidence(seen, predicted_px, model, edges.max_angle_rad, times[i])
            if self.keypoints is None or prepared[i] is None:
                return found
            return replace(found, keypoints=self.keypoints.in_view(shown[i], i, found.camera))

        return tuple(
            self._pool.map(
                observe, range(len(self.cameras)), regions or everywhere, predicted_px or everywhere,
                static_edges or everywhere,
            )
        )  # fmt: skip

    def _prepare(self, k: int) -> list[Prepared | None]:
        shown, chosen = self._shown(k), self._in_recording
        frames: Sequence[Image | None]
        if set(shown) != {k}:
            frames = self.recording.read_each(shown, chosen)
        else:
            frames = self.recording.read(k) if chosen is None else self.recording.read(k, chosen)
        return prepare_views(self._views, frames, shown)

    def _find_ahead(
        self,
        prepared: Future[list[Prepared | None]],
        regions: Sequence[Region | None],
        with_static_edges: bool,
        edges: EdgeSettings,
    ) -> list[RegionFeatures]:
        n = len(self._views)
        return list(
            self._pool_ahead.map(
                Foreground.features, self._views, prepared.result(), regions, [with_static_edges] * n, [edges] * n
            )
        )


@contextmanager
def open_observer(cameras: Sequence[CameraSource]) -> Generator[Observer, None, None]:
    """Open the footage of cameras, and yield an observer of it.

    Raises:
        RecordingError: the footage or a background cannot be read.
    """
    with Recording(cameras) as recording:
        yield Observer(cameras, recording)
