"""Name the people of key points by the stored poses of the session, where there are some."""

from collections.abc import Sequence

import numpy as np

from tracker.geometry.arrays import Array
from tracker.interchange.observations.identities import SAME_PERSON_M
from tracker.session.session import Session
from tracker.session.store.stored_poses import read_stored_poses


def people_by_poses(
    session: Session, people: Sequence[str], names: Sequence[str], joints_world: Array
) -> tuple[str, ...]:
    """Return the name of each observed person: whose stored poses its joints are nearest to.

    The sum of the median distances is least (the Hungarian method). Distances beyond the width of a person count alike,
    so that poses elsewhere decide nothing. The order given stays where poses decide nothing.

    Args:
        session: its stored poses.
        people: names in the order of the observed people.
        names: of the points of a body, (n_points,).
        joints_world: observed joints, (n_frames, n_people, n_points, 3), metres; NaN where unknown.
    """
    if len(people) < 2:
        return tuple(people)
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    costs = np.array([_distances(session, name, names, joints_world) for name in people])
    others = ~np.eye(len(people), dtype=bool)
    rows, columns = linear_sum_assignment(np.where(others, costs + 1e-6, costs))  # of equal ones, the order given
    out = list(people)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        out[column] = people[row]
    return tuple(out)


def _distances(session: Session, name: str, names: Sequence[str], joints_world: Array) -> Array:
    """Return the median distance of each observed person from one's poses, (n_people,), `SAME_PERSON_M` at most."""
    out = np.full(joints_world.shape[1], SAME_PERSON_M)
    model = next(p.model for p in session.people if p.name == name)
    poses = read_stored_poses(session.annotations_path, name, model)
    apart = []
    for frame, pose in poses.items():
        known = pose.body.model.point_names
        at = [i for i, n in enumerate(names) if n in known]
        if 0 <= frame < len(joints_world):
            own = pose.body.joint_centers_world[[known.index(names[i]) for i in at]]
            apart.append(np.linalg.norm(joints_world[frame][:, at] - own, axis=-1).T)
    if apart:
        for k, column in enumerate(np.concatenate(apart).T):
            found = column[np.isfinite(column)]
            if len(found):
                out[k] = min(float(np.median(found)), SAME_PERSON_M)
    return out
