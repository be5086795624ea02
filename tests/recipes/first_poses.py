"""Make the hand-made poses of frame 0 of a sample's people: `python tests/recipes/first_poses.py SESSION`.

A scripted user places each body as the page does (`tracker.estimation.posing.drag`): upright in the middle at first, by
moving the trunk, turning it by its slider, lifting the arms by theirs, and dragging joints in the two views that show
each best. The user sees where the joints are, 3 px off, another 3 px each time, and knows nothing of the third
dimension.
"""

import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from scripted_user import LIMBS, TRUNK, ScriptedUser

from tracker.body.model import PosedBody
from tracker.estimation.posing.default_pose import default_pose
from tracker.estimation.posing.drag import drag
from tracker.estimation.posing.grab import grab
from tracker.evidence.contours.part_edges import points_occluded
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table, write_pose_table
from tracker.session.session import load_session

FRAME = 0
SLIDER_STEP_DEG = 5.0
"""Nobody sets a slider finer by the eye."""
JOINTS = [
    f"{side}_{joint}"
    for limb in (("knee", "ankle"), ("elbow", "wrist"))
    for side in ("left", "right")
    for joint in limb
]


def main(folder):
    session = load_session(folder)
    truths = [true_body(folder / f"truth_{p.name}") for p in session.people]
    for person, who in enumerate(session.people):
        user = ScriptedUser(
            session, folder / f"truth_{who.name}.trc", FRAME, person, range(len(session.cameras)), person
        )
        cameras = [c.camera.pinhole for c in session.cameras]
        values = placed(user, cameras, views_of(cameras, truths, person))
        write_pose_table(folder / f"first_pose_{who.name}.csv", who.model, np.round(values, 4)[None], [FRAME])
        print(f"{who.name}: {user.error_mm(values):.0f} mm from the truth")


def true_body(stem):
    """Who hides whom is seen in the footage, which shows the true bodies."""
    model = load_model(stem.with_name(f"{stem.name}_model.toml"))
    return PosedBody(model, read_pose_table(stem.with_suffix(".csv")).values_for(model)[FRAME])


def views_of(cameras, truths, person):
    """The two views in which a person would drag each joint: those that show it, and as much as possible across."""
    model, values = truths[person].model, truths[person].values
    points = model.named_points_world(values)
    views = {}
    for name in LIMBS:
        hidden = points_occluded(truths, cameras, points[name][None])[:, 0]
        rays = [(points[name] - camera.center_world) for camera in cameras]
        rays = [ray / np.linalg.norm(ray) for ray in rays]
        pairs = [(a, b) for a in range(len(cameras)) for b in range(a)]
        views[name] = min(
            pairs, key=lambda pair: (int(hidden[pair[0]]) + int(hidden[pair[1]]), abs(rays[pair[0]] @ rays[pair[1]]))
        )
    return views


def placed(user, cameras, views):
    """The pose after all drags."""
    model = user.model
    values = default_pose(model, cameras)
    for _ in range(2):
        values = trunk_moved(user, cameras, values)
        values = slid(user, values, "torso.twist", TRUNK)
        for joint in ("left_shoulder", "right_shoulder"):
            values = joint_dragged(user, cameras, values, joint, views[joint][0])
    values = trunk_moved(user, cameras, values)
    for side in ("left", "right"):  # an elbow that is dragged up from a hanging arm may come up on its other side
        values = slid(user, values, f"{side}_shoulder.abduction", [f"{side}_elbow"])
    for _ in range(3):  # each look corrects what the one before has left
        for joint in JOINTS:
            for view in views[joint]:
                values = joint_dragged(user, cameras, values, joint, view)
    return values


def trunk_moved(user, cameras, values):
    for view in (0, 1):
        px = cameras[view].project(user.model.points_world(values)[0])
        hand = grab(user.model, values, cameras[view], user.model.point_names[0], px)
        values = drag(hand, px + user.trunk_off_px(values, view), values)
    return values


def slid(user, values, slider, joints):
    """Set a slider to where some joints look best."""
    aims = {(name, view): user.aim_px(name, view) for name in joints for view in user.views}
    at = user.model.value_names.index(slider)
    low, high = np.degrees(np.clip(user.model.limits[user.model.dof_names.index(slider)], -np.pi, np.pi))
    tried = {}
    for degrees in np.arange(low, high, SLIDER_STEP_DEG):
        trial = values.copy()
        trial[at] = np.radians(degrees)
        tried[degrees] = user.seen_off_px(trial, joints, aims)
    values = values.copy()
    values[at] = np.radians(min(tried, key=tried.__getitem__))
    return values


def joint_dragged(user, cameras, values, joint, view):
    px = cameras[view].project(user.model.points_world(values)[user.model.point_names.index(joint)])
    return drag(grab(user.model, values, cameras[view], joint, px), user.aim_px(joint, view), values)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
