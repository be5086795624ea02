"""Key points of people as evidence: where a detector saw points of the body in the picture of each view.

Detectors are consistently off: the hip of most lies higher and farther out than the joint. Each point therefore has an
offset from the joint in the frame of its part, and a standard deviation, both learnt per recording
(`tracker.estimation.acquisition.from_keypoints`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera


class ViewKeypoints(NamedTuple):
    """Key points of one person in one view."""

    parts: IntArray
    """Part of the body that each moves with, (N,)."""
    points_part: Array
    """Place of each in its part, (N, 3), metres."""
    positions_px: Array
    """Observed position of each, (N, 2), px of the view."""
    sigmas_px: Array
    """Standard deviation of each, (N,), px of the view."""


@dataclass(frozen=True, eq=False)
class PersonKeypoints:
    """Key points of one person over a recording."""

    parts: IntArray
    """Part of the body that each moves with, (N,)."""
    points_part: Array
    """Place of each in its part, (N, 3), metres."""
    seen: Array
    """Observed position of each, (F, V, N, 2), in normalized image coordinates x / z; NaN where absent."""
    sigmas: Array
    """Standard deviation of each, (F, V, N), in normalized image coordinates."""

    def in_view(self, frame: int, view: int, camera: Camera) -> ViewKeypoints:
        """Return those that a view shows on a frame, in the pixels of a camera of the view without a lens."""
        seen = self.seen[frame, view]
        known = np.isfinite(seen).all(axis=1)
        px = seen[known] @ camera.K[:2, :2].T + camera.K[:2, 2]
        scale = float(np.sqrt(abs(np.linalg.det(camera.K[:2, :2]))))
        return ViewKeypoints(
            self.parts[known], self.points_part[known], px, scale * self.sigmas[frame, view, known]
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class KeypointEvidence:
    """Key points of all people over a recording, by index of the person; None for people without any."""

    people: tuple[PersonKeypoints | None, ...]

    def of_views(self, chosen: Sequence[int]) -> "KeypointEvidence":
        """Return those in some of the views, by their indices."""
        return KeypointEvidence(
            tuple(
                None if p is None else replace(p, seen=p.seen[:, list(chosen)], sigmas=p.sigmas[:, list(chosen)])
                for p in self.people
            )
        )

    def in_view(self, frame: int, view: int, camera: Camera) -> tuple[ViewKeypoints | None, ...]:
        """Return the key points of each person in a view of a frame; see `PersonKeypoints.in_view`."""
        return tuple(None if p is None else p.in_view(frame, view, camera) for p in self.people)
