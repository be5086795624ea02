"""Small pictures of the footage, as large and good as a number of bytes allows."""

from typing import NamedTuple

import cv2
import numpy as np

from app.drawing.pictures import placeholder
from app.share.overlay_lines import compact, view_lines
from tracker.errors import TrackerError
from tracker.evidence.images.working_view import WorkingView
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Image
from tracker.interchange.exports.motion import ExportedMotion
from tracker.session.session import Session

_SAMPLES = 3
"""Number of frames that are encoded to foretell the size of all."""
_MARGIN = 1.1
"""Frames between the samples may be larger: on tracked simulated footage by less than 5%."""


class Grade(NamedTuple):
    """Size and quality of pictures."""

    side_px: int
    """Width or height, whichever is larger; smaller footage keeps its size."""
    quality: int
    """Of WebP, 1 to 100."""


GRADES = tuple(
    Grade(side, quality)
    for side, quality in ((960, 80), (960, 60), (800, 60), (640, 60), (640, 40), (480, 40), (480, 25), (320, 25))
)
"""Best first. 960 px fill a quarter of a full HD screen; at 320 px and quality 25 a person is hardly recognized."""


class Encoder:
    """Pictures of a session's views, undistorted, in one grade."""

    def __init__(self, session: Session, grade: Grade) -> None:
        """Compute the maps of all pixels.

        Args:
            session: with its cameras.
            grade: size and quality.
        """
        self.quality = grade.quality
        self.views = [
            WorkingView(c.camera, min(1.0, grade.side_px / max(c.camera.pinhole.size)), cv2.BORDER_CONSTANT)
            for c in session.cameras
        ]

    def encode(self, index: int, image: Image | None) -> bytes:
        """Return the picture of a view as WebP.

        Args:
            index: of the view.
            image: as filmed, (H, W, 3) RGB; None for a damaged frame.
        """
        view = self.views[index]
        shown = placeholder(view.camera.size, "frame damaged") if image is None else view.image(image, view.whole)
        bgr = cv2.cvtColor(np.ascontiguousarray(shown), cv2.COLOR_RGB2BGR)
        done, data = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, self.quality])
        assert done
        return bytes(data)


def choose_encoder(
    motion: ExportedMotion, recording: Recording, most_bytes: float, bytes_per_byte: float = 1.0
) -> Encoder:
    """Return the encoder of the best grade with which pictures and lines have room.

    Args:
        motion: its frames will have pictures and lines.
        recording: the footage.
        most_bytes: for all pictures and lines together.
        bytes_per_byte: size that each byte of a picture takes.

    Raises:
        TrackerError: not even the least grade fits.
        RecordingError: the footage cannot be read.
    """
    frames, session = motion.frames, motion.session
    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).astype(int))]
    samples = [recording.read(frame) for frame in chosen]
    expected = 0.0
    for grade in GRADES:
        encoder = Encoder(session, grade)
        n_bytes: float = sum(len(compact(view_lines(motion, frame, encoder.views))) for frame in chosen)
        n_bytes += sum(bytes_per_byte * len(encoder.encode(i, x)) for images in samples for i, x in enumerate(images))
        expected = _MARGIN * n_bytes / len(chosen) * len(frames)
        if expected <= most_bytes:
            return encoder
    count = f"{len(frames)} frames of {len(session.cameras)} views"
    raise TrackerError(
        f"expected room for the pictures of {count}, {expected / 1e6:.1f} MB at {GRADES[-1].side_px} px, found "
        f"{most_bytes / 1e6:.1f} MB; share fewer frames"
    )
