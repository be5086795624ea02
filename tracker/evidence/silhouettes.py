"""Find the silhouettes of a frame in all views, from the user's masks or by background subtraction.

Silhouettes are in *raw* pixels: as filmed, lens distortion included, at working scale. A look-up table
(`tracker.evidence.voxels.carving`) leads from points in space to them (MTHC01 Sect. 2).
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Literal, NamedTuple

import cv2
import numpy as np

from tracker.errors import RecordingError, Remedy
from tracker.evidence.images.background_subtraction import (
    SHADOWS_AND_HIGHLIGHTS,
    BackgroundModel,
    Changes,
    Mask,
    Shading,
    apply_gain,
    background_of_clip,
    background_of_recording,
    clean_silhouette,
    exposure_and_threshold,
    smooth_image,
    subtract_background,
)
from tracker.evidence.images.edges import SPACING_PX
from tracker.evidence.images.working_view import WorkingView
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import parts_of_mask
from tracker.footage.recording import Recording, background_frames, read_mask
from tracker.geometry.arrays import Image
from tracker.geometry.cameras import Camera

SilhouetteSource = Literal["mask", "background", "recording", "none"]
"""Source of a silhouette: the user's mask, an empty scene, the recording's own median, or none: a damaged frame, or one
without a mask where others have one and the view has no background."""

N_LEARNED = 25
"""Number of frames from which the empty scene is learnt where the session has none."""


class ViewSilhouette(NamedTuple):
    """The people in one view of a frame."""

    mask: Mask
    """(H, W), raw pixels at working scale; nobody where the frame is damaged."""
    camera: Camera
    """Camera of these pixels, with its lens distortion."""
    quality: float
    """How cleanly the silhouette was found, 0 to 1, see `CleanSilhouette`; 1 for a user's mask."""
    source: SilhouetteSource
    """Its source."""
    shadow: Mask | None = None
    """Other changes, (H, W): shadows, highlights, and clothes that look like them. Of a user's mask what it leaves
    unknown; None if that is nothing."""

    @property
    def is_empty(self) -> bool:
        """Whether nobody was found."""
        return not self.mask.any()


class SilhouetteFinder:
    """Finds the silhouettes of a recording. Thread-safe."""

    def __init__(
        self,
        cameras: Sequence[CameraSource],
        recording: Recording,
        shading: Shading = SHADOWS_AND_HIGHLIGHTS,
        step: Callable[[], None] = lambda: None,
        recording_views: Sequence[int] | None = None,
    ) -> None:
        """Read the backgrounds, or learn them from the recording where there are none.

        Args:
            cameras: the views, with their side files.
            recording: their footage.
            shading: changes of the light that are background.
            step: called for each image whose background is learnt or subtracted, from several threads. An exception
                that it raises ends the work.
            in_recording: index of each view in the recording, if it has others too.

        Raises:
            RecordingError: a background is unreadable or of the wrong size.
        """
        self.cameras, self.recording = tuple(cameras), recording
        self._shading, self._step = shading, step
        self._in_recording = range(len(self.cameras)) if recording_views is None else recording_views
        # Without a lens, a camera's working view is the footage itself, reduced.
        self._views = [WorkingView(replace(c.camera, distortion=np.zeros(0), fisheye=False)) for c in self.cameras]
        self._pool = ThreadPoolExecutor(2, "silhouettes", initializer=cv2.setNumThreads, initargs=(1,))
        self._models = list(self._pool.map(self._model, range(len(self.cameras))))

    def silhouettes(self, k: int, person: int | None = None) -> tuple[ViewSilhouette, ...]:
        """Find the silhouettes of frame k in all views, each in the picture that is nearest in time to the frame.

        Args:
            k: frame number.
            person: index of a person whom numbered masks are restricted to; None for everybody.

        Raises:
            RecordingError: the frame or a mask cannot be read.
        """
        shown = [c.clock.nearest(k, self.recording.n_frames) for c in self.cameras]
        of, where = self.recording, self._in_recording
        frames = of.read(k, where) if set(shown) == {k} else of.read_each(shown, where)
        return tuple(self._pool.map(lambda i: self._silhouette(i, frames[i], shown[i], person), range(len(frames))))

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def _silhouette(self, i: int, frame: Image | None, k: int, person: int | None) -> ViewSilhouette:
        source, view = self.cameras[i], self._views[i]
        camera = source.camera.scaled(view.scale)
        mask = read_mask(source, k)
        if mask is not None:
            people, unknown = parts_of_mask(mask, person)
            unsure = None if unknown is None else view.mask(unknown, view.whole)
            return ViewSilhouette(view.mask(people, view.whole), camera, 1.0, "mask", unsure)
        if frame is None or (source.masks is not None and source.background is None):
            return ViewSilhouette(np.zeros((camera.height, camera.width), bool), camera, 0.0, "none")
        model = self._models[i]
        changes = self._changes(self._smooth(i, frame), model)
        clean = clean_silhouette(changes.inside)
        origin: SilhouetteSource = "recording" if source.background is None else "background"
        return ViewSilhouette(clean.mask, camera, clean.quality, origin, changes.anything & ~clean.mask)

    def _changes(self, smooth: Image, model: BackgroundModel) -> Changes:
        samples, empty = (x[::SPACING_PX, ::SPACING_PX].reshape(-1, 3) for x in (smooth, model.image))
        colors, empty_colors = samples.astype(np.float32), empty.astype(np.float32)
        gain, threshold = exposure_and_threshold(colors, empty_colors)
        background = apply_gain(model.image, gain)
        return subtract_background(smooth, background, threshold, self._shading, model.noise)

    def _smooth(self, i: int, frame: Image) -> Image:
        self._step()
        view = self._views[i]
        return smooth_image(view.image(frame, view.whole))

    def _model(self, i: int) -> BackgroundModel:
        source = self.cameras[i]
        found = background_of_clip(self._smooth(i, frame) for frame in background_frames(source))
        return self._learnt(i) if found is None else found

    def _learnt(self, i: int) -> BackgroundModel:
        last, view = self.recording.n_frames - 1, self._in_recording[i]
        spread = sorted({round(j * last / (N_LEARNED - 1)) for j in range(N_LEARNED)})
        frames = (self.recording.read_view(view, k) for k in spread)
        images = [self._smooth(i, f) for f in frames if f is not None]
        if not images:
            raise RecordingError(
                f"camera '{self.cameras[i].camera.name}': no frame of {self.cameras[i].footage} can be decoded to "
                "learn the background",
                Remedy("give_background"),
            )
        return background_of_recording(images)
