"""Silhouettes of a person in footage: from masks of other programs, or from the changes against the still room."""

from collections.abc import Sequence
from contextlib import closing

import numpy as np

from tracker.calibration.self_calibration.person_silhouettes import NOTHING, Flaw, PersonSilhouette, measure_silhouette
from tracker.compute.progress import Report
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.footage.image_file import parts_of_mask
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.plans import MaskPlan
from tracker.session.session import Session


def silhouettes_in_masks(
    plan: MaskPlan, session: Session, cameras: Sequence[Camera], report: Report
) -> list[list[PersonSilhouette]]:
    """Measure the silhouettes of masks, by frame and camera.

    Args:
        plan: an import of masks.
        session: its cameras and frames.
        cameras: with their lenses, in the order of the session's.
        report: receives the progress.

    Raises:
        TrackerError: a mask is damaged.
    """
    out = [[NOTHING] * len(cameras) for _ in range(session.n_frames)]
    for v, (source, camera) in enumerate(zip(session.cameras, cameras, strict=True)):
        pictures = plan.pictures[camera.name]
        for i, picture in enumerate(pictures):
            report("reading masks", (v + i / len(pictures)) / len(cameras))
            k = int(picture) - source.offset
            if picture < 0 or not 0 <= k < session.n_frames:
                continue
            labels = np.unique(plan.masks[camera.name].read(i, source.camera.size).labels)
            if not plan.rules.is_matte and np.count_nonzero(labels) > 1:
                out[k][v] = PersonSilhouette(flaw=Flaw.SEVERAL)
                continue
            out[k][v] = _measured(parts_of_mask(plan.mask(camera.name, i, source.camera.size))[0] > 0, camera, 1.0)
    return out


def silhouettes_in_footage(session: Session, cameras: Sequence[Camera], report: Report) -> list[list[PersonSilhouette]]:
    """Find and measure silhouettes by subtracting the backgrounds that still cameras show, by frame and camera.

    Raises:
        RecordingError: footage cannot be read.
    """
    out = []
    with Recording(session.cameras) as recording, closing(SilhouetteFinder(session.cameras, recording)) as finder:
        for k in range(session.n_frames):
            report("finding silhouettes", k / session.n_frames)
            views = finder.silhouettes(k)
            found = zip(views, cameras, strict=True)
            out.append([_measured(v.mask, c, v.camera.size[0] / c.size[0]) for v, c in found])
    return out


def _measured(mask: Mask, camera: Camera, scale: float) -> PersonSilhouette:
    """Measure a silhouette in a mask that is smaller than the picture of a camera by a scale."""

    def original(points_px: Array) -> Array:
        return np.asarray((points_px + 0.5) / scale - 0.5)

    found = measure_silhouette(mask, lambda px: camera.undistort_points(original(px)))
    return found._replace(hull_px=original(found.hull_px), upright_px=original(found.upright_px))
