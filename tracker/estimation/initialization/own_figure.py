"""The figure of one person among those of a visual hull, and where it goes."""

from collections.abc import Mapping, Sequence

import numpy as np

from tracker.body.model import PosedBody
from tracker.body.motion.path_identities import SAME_PERSON_M
from tracker.errors import Remedy, TrackerError
from tracker.evidence.voxels.visual_hull import VisualHull
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.session.session import Session
from tracker.session.store.stored_poses import read_stored_poses

_MAX_HULL_M3 = 0.25
"""Largest volume of the visual hull of one person, cubic metres: three times that of a large man."""


def others_on_frame(session: Session, person: int, frame: int, found: Mapping[int, PosedBody]) -> list[PosedBody]:
    """Return the other people who have a pose on a frame, found just now or stored."""
    bodies = []
    for i, other in enumerate(session.people):
        if i == person:
            continue
        if i in found:
            bodies.append(found[i])
            continue
        stored = read_stored_poses(session.annotations_path, other.name, other.model, range(frame, frame + 1))
        if frame in stored:
            bodies.append(stored[frame].body)
    return bodies


def own_figure(session: Session, person: int, hull: VisualHull, others: Sequence[PosedBody]) -> Voxels:
    """Return the largest figure that nobody else has a pose in.

    Raises:
        TrackerError: there are more figures than people, or none is left.
    """
    figures, n_people = hull.figures, len(session.people)
    if len(figures) > n_people:
        raise TrackerError(
            f"expected {n_people} person{'s' * (n_people > 1)} as the session has, found {len(figures)} figures that "
            "stand apart",
            Remedy("name_all_people"),
        )
    free = [f for f in figures if not any(_is_in(f, body) for body in others)]
    if not free:
        raise TrackerError(
            f"expected a figure of '{session.people[person].name}', found only those of people who have a pose on this "
            "frame",
            Remedy("another_frame", condition="all stand apart"),
        )
    if (len(figures) < n_people and free[0].volume_m3 > _MAX_HULL_M3) or len(free) + len(others) < n_people:
        raise TrackerError(
            f"expected {n_people} figures that stand apart, found {len(figures)}",
            Remedy("another_frame", condition="people do not touch"),
        )
    if free[0].volume_m3 > _MAX_HULL_M3:
        least = hull.least_explained
        camera = None if least is None else session.cameras[least].camera.name
        reason = "views may be too few" if camera is None else f"the silhouette in {camera} may show more than people"
        raise TrackerError(
            f"expected one person of at most {1000 * _MAX_HULL_M3:.0f} litres, found a figure of "
            f"{1000 * free[0].volume_m3:.0f}: several people may touch, or {reason}",
            Remedy("another_frame", condition="people do not touch") if camera is None
            else Remedy("another_frame_or_background"),
            camera,
        )  # fmt: skip
    return free[0]


def _is_in(figure: Voxels, body: PosedBody) -> bool:
    trunk = body.points_world.mean(axis=0)
    return bool(np.linalg.norm(figure.points_world.mean(axis=0) - trunk) < SAME_PERSON_M)
