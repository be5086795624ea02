"""Characters that move as the people of a session do, drawn beside the footage (KRH08 Sect. 6.1)."""

from collections.abc import Sequence

import cv2
import numpy as np

from app.drawing import overlay_colors
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.posing.character import drive_character
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.label_image import part_labels
from tracker.geometry.arrays import Image
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane, up_rotation
from tracker.geometry.lens_tables import lens_of, undistortion_map
from tracker.interchange.exports.motion import ExportedMotion

_GROUND = (38, 40, 44)
"""Colour behind the characters, RGB."""
_OUTLINE = (16, 17, 19)


class Characters:
    """One character for each exported person."""

    def __init__(self, motion: ExportedMotion, character: BodyModel) -> None:
        """Take the motion.

        Args:
            motion: of the people.
            character: the body that moves as they do.
        """
        self._motion, self._character, self._floor = motion, character, _floor(motion)

    def bodies(self, frame: int) -> list[PosedBody]:
        """Return the characters of the exported people who have a pose in a frame."""
        posed = [body for p, body in self._motion.bodies(frame) if self._motion.is_exported(p, frame)]
        return [
            PosedBody(self._character, drive_character(b.values, b.model, self._character, self._floor)) for b in posed
        ]


def draw_bodies(bodies: Sequence[PosedBody], camera: Camera) -> Image:
    """Draw bodies in the colours of their parts, with their visible contours, as a camera without distortion sees them.

    A fisheye lens is kept, since a picture without it would have another size than the footage beside it.

    Returns:
        The image, (H, W, 3) RGB, of the size of the footage.
    """
    plain = camera.pinhole
    colors = [overlay_colors.rgb(part.color) for body in bodies for part in body.model.parts]
    image = np.array([_GROUND, *colors], np.uint8)[part_labels(bodies, plain)]
    if bodies:
        contour = occluding_contours.trace(bodies, plain)
        ends = np.rint(contour.pieces_px[~contour.occluded].reshape(-1, 2, 2)).astype(np.int32)
        cv2.polylines(image, list(ends), False, _OUTLINE, max(1, round(max(camera.size) / 640)), cv2.LINE_AA)
    if camera.fisheye:
        maps = undistortion_map(lens_of(camera))
        filmed = cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=_GROUND)
        return np.asarray(filmed, dtype=np.uint8)
    return np.asarray(image, dtype=np.uint8)


def _floor(motion: ExportedMotion) -> GroundPlane:
    """Return the floor of the session; without one a plane through the lowest point of all exported poses."""
    session = motion.session
    if session.floor is not None:
        return session.floor
    up = up_rotation(session.up, None)[:, 2]
    bodies = [pose.body for p in motion.exported for pose in p.poses.values()]
    return GroundPlane(up, min((float((b.points_world @ up).min()) for b in bodies), default=0.0))
