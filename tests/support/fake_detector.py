"""A detector that knows the truth: it finds the people whose points were projected into the pictures."""

import numpy as np

from tracker.interchange.detection.detector import DetectedPerson, PictureSquare


def box_of(px, shape):
    """Probability that each pixel of a picture shows a person: 1 in the rectangle around the points."""
    out = np.zeros(shape, np.float32)
    (left, top), (right, bottom) = (f(px, axis=0).round().astype(int) for f in (np.nanmin, np.nanmax))
    out[max(0, top) : max(0, bottom), max(0, left) : max(0, right)] = 1.0
    return out


class FakeDetector:
    """Finds people by their projected points; a picture is marked with its view and frame."""

    skeleton = "BODY_25"

    def __init__(self, points, unfound=(), unseen=()):
        """Args: points, (n_frames, n_views, n_people, n_points, 3), x, y, confidence; views and people not found by
        the search of whole pictures, and not seen at all, as pairs of view and person."""
        self.points, self.unfound, self.unseen, self.n_finds, self.looks = points, unfound, unseen, 0, []

    def read(self, k):
        """Pictures of a frame, as a recording reads them."""
        return tuple(np.array([[[v, k % 256, k // 256]]], np.uint8).repeat(640, 1).repeat(480, 0) for v in self.views)

    @property
    def views(self):
        return range(self.points.shape[1])

    def find(self, picture, square):
        self.n_finds += 1
        out = []
        for person, points in self._people(picture):
            center = (points[9, :2] + points[12, :2]) / 2
            is_within = np.abs(center - square.center_px).max() < square.side_px / 2
            if is_within and (picture[0, 0, 0], person) not in self.unfound:
                out.append(PictureSquare(center, 2.4 * (np.nanmax(points[:, 1]) - np.nanmin(points[:, 1]))))
        return out

    def look(self, picture, square):
        self.looks.append(square)
        near = []
        for person, points in self._people(picture):
            if (picture[0, 0, 0], person) not in self.unseen:
                apart = np.linalg.norm((points[9, :2] + points[12, :2]) / 2 - square.center_px)
                near.append((apart, person, points))
        apart, _, points = min(near, default=(np.inf, 0, None), key=lambda found: found[:2])
        if apart >= 0.2 * square.side_px:
            return None
        px = points[:, :2].copy()
        return DetectedPerson(px, points[:, 2], 1.0, lambda shape: box_of(px, shape))

    def _people(self, picture):
        view, low, high = picture[0, 0].tolist()
        return list(enumerate(self.points[low + 256 * high, view]))
