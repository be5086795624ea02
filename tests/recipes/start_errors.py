"""Print the errors of first poses against reference joints: `python tests/recipes/start_errors.py SESSION TRC...`.

For each person of the session one TRC file. Rows: every few frames, the mean distance of the 12 limb joints before and
after the fit in mm, whether left is left, the distance of the head, and what was not resolved. `--method axis` takes
the axes of the silhouettes (GD96 Sect. 4.1) instead of voxels.
"""

import argparse
from pathlib import Path

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.initialization.frame_trials import find_first_poses
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.session.session import load_session


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("session", type=Path)
    options.add_argument("references", type=Path, nargs="+")
    options.add_argument("--method", default="voxels")
    options.add_argument("--every", type=int, default=5)
    arguments = options.parse_args()
    session = load_session(arguments.session)
    references = [read_joints(path, session.fps, None, "x,y,z") for path in arguments.references]
    with open_observer(session.cameras) as observer:
        rows = []
        for frame in range(0, session.n_frames, arguments.every):
            try:
                people, methods = range(len(session.people)), arguments.method.split(",")
                first = find_first_poses(session, observer, people, [frame], methods)
            except TrackerError as error:
                print(f"{frame:4d} {error}")
                continue
            rows += [_row(pose, references, frame) for pose in first.poses.values()]
    errors, sides = np.array(rows).T
    print(f"{len(rows)} starts: {errors.mean():.0f} mm, worst {errors.max():.0f}; left right in {sides.mean():.0%}")


def _row(found, references, frame):
    """Errors of one start against the reference that it is nearest to."""
    errors = []
    for reference in references:
        row = int(np.flatnonzero(reference.frames == frame)[0])
        points = dict(zip(reference.names, reference.points[row], strict=True))
        after = _errors(found.model, found.start.pose, points)
        left = points["left_shoulder"] - points["right_shoulder"] + points["left_hip"] - points["right_hip"]
        own = found.model.named_points_world(found.start.pose)
        mine = own["left_shoulder"] - own["right_shoulder"] + own["left_hip"] - own["right_hip"]
        errors.append((np.mean(after), float(mine @ left > 0)))
    best = min(errors)
    listed = " ".join(found.notes)
    print(f"{frame:4d} off {best[0]:4.0f} mm, left {'right' if best[1] else 'WRONG'}", end=" ")
    print(f"{found.start.source} {'sure' if found.is_facing_sure else 'unsure'}", end=" ")
    print(f"{found.model.height_m:.2f} m {found.status} {found.cost_px:.2f} px {listed[:150]}")
    return best


def _errors(model, pose, points):
    own = dict(zip(model.point_names, model.joint_centers_world(pose), strict=True))
    return [1000 * float(np.linalg.norm(own[n] - points[n])) for n in LIMB_JOINTS if np.isfinite(points[n]).all()]


if __name__ == "__main__":
    main()
