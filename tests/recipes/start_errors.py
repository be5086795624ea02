"""Print the errors of first poses against reference joints: `python tests/recipes/start_errors.py SESSION TRC...`.

For each person of the session one TRC file. Rows: every few frames, the mean distance of the 12 limb joints before and
after the fit in mm, whether left is left, the distance of the head, and what was not resolved. `--method axis` takes
the axes of the silhouettes (GD96 Sect. 4.1) instead of voxels.
"""

import argparse
from pathlib import Path

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.initialization.first_pose import find_first_poses
from tracker.estimation.initialization.generators.body_axis import find_body_axes
from tracker.estimation.initialization.generators.head_template import find_head
from tracker.estimation.initialization.generators.silhouette_axis import major_axis
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.evidence.voxels.paths import neighbor_graph
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.footage.recording import Recording
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.ground_plane import floor_plane
from tracker.session.session import load_session

HEAD_CENTER, HEAD_M = 0.07, 0.10
"""Centre of a head below its top, as a fraction of the height, and the error of a head that counts as located, m."""


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("session", type=Path)
    options.add_argument("references", type=Path, nargs="+")
    options.add_argument("--method", default="voxels")
    options.add_argument("--every", type=int, default=5)
    options.add_argument("--heads", action="store_true", help="only locate the head, for a single person")
    arguments = options.parse_args()
    session = load_session(arguments.session)
    references = [read_joints(path, session.fps, None, "x,y,z") for path in arguments.references]
    with Recording(session.cameras) as recording:
        observer = Observer(session.cameras, recording)
        if arguments.heads:
            _print_heads(session, recording, references[0], arguments.every)
            return
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


def _print_heads(session, recording, reference, every):
    """Print in how many frames each method locates the head within 10 cm of the reference."""
    finder, floor = SilhouetteFinder(session.cameras, recording), floor_plane(session.up, session.floor)
    height_m, off = session.people[0].model.height_m, {"voxels": [], "axis": []}
    for frame in range(0, session.n_frames, every):
        silhouettes = recover_from_shadows(finder.silhouettes(frame), floor, VOXEL_M)
        truth = dict(zip(reference.names, reference.points[frame], strict=True))["head"]
        figure = carve_people(silhouettes, VOXEL_M).figures[0]
        head = find_head(figure, neighbor_graph(figure))
        off["voxels"].append(np.inf if head is None else np.linalg.norm(head.center - truth))
        try:
            axes = [a for s in silhouettes if (a := major_axis(s.mask, s.camera)) is not None]
            found = find_body_axes(axes, floor.normal, height_m)[0]
            off["axis"].append(np.linalg.norm(found.top - HEAD_CENTER * height_m * found.up - truth))
        except TrackerError:
            off["axis"].append(np.inf)
    finder.close()
    for method, own in off.items():
        near = np.array(own) < HEAD_M
        print(f"{method}: head located in {near.mean():.0%} of {len(own)} frames, {1000 * np.median(own):.0f} mm off")


def _errors(model, pose, points):
    own = dict(zip(model.point_names, model.joint_centers_world(pose), strict=True))
    return [1000 * float(np.linalg.norm(own[n] - points[n])) for n in LIMB_JOINTS if np.isfinite(points[n]).all()]


if __name__ == "__main__":
    main()
