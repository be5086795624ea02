"""Check a start pose against the silhouettes of its person: never a body in empty space."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.start_fit import StartTrack
from tracker.evidence.contours.body_silhouette import body_silhouette
from tracker.evidence.contours.label_image import part_labels
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.view_evidence import ViewEvidence
from tracker.evidence.voxels.figure_masks import FigureMask
from tracker.geometry.arrays import Array, Mask, intersection_over_union

_MIN_OVERLAP = 0.55
"""Smallest overlap with the silhouettes in half of the views. A body of other proportions in about the right pose has
two thirds or more. One that stands beside the person or upside down has a half or less."""


class SilhouetteCheck(NamedTuple):
    """How well a body fills the silhouettes of its person."""

    cameras: tuple[str, ...]
    """Names of the views that show the person alone, or all people."""
    overlaps: Array
    """In each of these views the area that body and silhouette share, as a share of that of both, (n_views,)."""

    @property
    def is_refused(self) -> bool:
        """Whether the body is elsewhere in at least half of the views."""
        return bool(len(self.overlaps)) and float(np.median(self.overlaps)) < _MIN_OVERLAP

    @property
    def worst_camera(self) -> str | None:
        """Name of the view that contradicts the body most; None if no view shows the person alone."""
        return self.cameras[int(np.argmin(self.overlaps))] if self.cameras else None

    @property
    def note(self) -> str:
        """A sentence on the views that contradict the body; empty if none does."""
        if not self.cameras:
            return "no view shows the person alone, so that the silhouettes do not check the pose"
        poor = [
            f"{name} {100 * share:.0f}%"
            for name, share in zip(self.cameras, self.overlaps, strict=True)
            if share < _MIN_OVERLAP
        ]
        return f"the body and the silhouette share little of their area in view {', '.join(poor)}" if poor else ""


def check_against_silhouettes(
    body: PosedBody, silhouettes: Sequence[ViewSilhouette], masks: Sequence[FigureMask]
) -> SilhouetteCheck:
    """Compare a body with the silhouettes of its person in the views that show the person alone.

    Args:
        body: the body.
        silhouettes: of all people, in all views.
        masks: that of the person in each of them.
    """
    return _shared(
        (s.camera.name, body_silhouette([body], s.camera), m.mask)
        for s, m in zip(silhouettes, masks, strict=True)
        if m.shows_figure_alone
    )


def check_all_people(bodies: Sequence[PosedBody], views: Sequence[ViewEvidence]) -> SilhouetteCheck:
    """Compare all people of a frame with the silhouettes that show them together.

    Args:
        bodies: of all people.
        views: those without a silhouette are left out.
    """
    seen = [(v.camera, v.silhouette.inside) for v in views if v.silhouette is not None]
    return _shared((camera.name, part_labels(bodies, camera) > 0, inside) for camera, inside in seen)


def _shared(seen: Iterable[tuple[str, Mask, Mask]]) -> SilhouetteCheck:
    """Return the share of both areas that two masks of each view have in common."""
    found = [(name, intersection_over_union(one, other)) for name, one, other in seen]
    return SilhouetteCheck(tuple(name for name, _ in found), np.array([share for _, share in found]))


def starts_in_silhouettes(
    tracked: Sequence[StartTrack], silhouettes: Sequence[ViewSilhouette], masks: Sequence[FigureMask]
) -> list[StartTrack]:
    """Return the starts whose bodies fill the silhouettes.

    Raises:
        TrackerError: none does.
    """
    checks = [check_against_silhouettes(t.start.body, silhouettes, masks) for t in tracked]
    kept = [track for track, check in zip(tracked, checks, strict=True) if not check.is_refused]
    if not kept:
        raise TrackerError(
            f"expected a body that fills the silhouettes, found none: {checks[0].note}",
            Remedy("another_frame_or_place"),
            checks[0].worst_camera,
        )
    return kept


def is_cut_off(mask: Mask) -> bool:
    """Return whether a silhouette, (H, W), touches the border of the picture."""
    return bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
