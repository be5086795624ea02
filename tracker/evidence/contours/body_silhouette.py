"""Paint the silhouettes of posed bodies in raw pixels: as filmed, lens distortion included."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.evidence.contours.label_image import part_labels
from tracker.geometry.cameras import Camera
from tracker.geometry.lens_tables import lens_of, undistortion_map


def body_silhouette(bodies: Sequence[PosedBody], camera: Camera) -> NDArray[np.bool_]:
    """Return the pixels that bodies cover, (H, W), in the raw pixels of a camera.

    Pixels that only a lens shows, beyond the undistorted image, are left out.
    """
    covered = part_labels(bodies, camera.pinhole) > 0
    if camera.is_pinhole:
        return np.asarray(covered)
    found = cv2.remap(covered.view(np.uint8), *undistortion_map(lens_of(camera)), cv2.INTER_NEAREST)
    return np.asarray(found).view(np.bool_)
