"""Scripted user with 3 px noise: sees the true joints in two views, some pixels off, and nothing else."""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints

NOISE_PX = 3.0
LIMBS = [
    f"{side}_{joint}" for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in ("left", "right")
]
ORDER = ["torso", "torso", "left_shoulder", "right_shoulder"] + [
    f"{side}_{joint}"
    for limb in (("knee", "ankle"), ("elbow", "wrist"))
    for side in ("left", "right")
    for joint in limb
    for _ in range(2)
]
"""Points that are dragged to place a person, from the trunk outwards, each in the next view."""
TRUNK = [name for name in LIMBS if name.endswith(("shoulder", "hip"))]


class ScriptedUser:
    """What the user aims at on one frame, and how far off the body is, which only the test knows."""

    def __init__(self, session, truth, frame, seed, views, person=0):
        self.model = session.people[person].model
        self.views = views
        joints = read_joints(truth, session.fps)
        self._places = dict(zip(joints.names, joints.points[frame], strict=True))
        self._cameras = [c.camera.pinhole for c in session.cameras]
        self._rng = np.random.default_rng(seed)

    def away(self):
        """Where the user finds the body: 40 cm and 30 degrees from where it belongs, upright, the arms down."""
        model, rng = self.model, self._rng
        known = {n: p for n, p in self._places.items() if n in model.point_names}
        there = fit_to_points(model, known).pose
        values = model.neutral()
        values[:6] = there[:6]
        way = rng.uniform(0, 2 * np.pi)
        step = np.zeros(model.n_dofs)
        step[:3] = 0.4 * np.array([np.cos(way), np.sin(way), 0.0])
        values = model.retract(values, step)
        turn = Rotation.from_rotvec([0, 0, np.radians(30) * rng.choice([-1, 1])]).as_matrix()
        wanted = turn @ model.kinematics(values).Ts_world_part[0][:3, :3]

        def off(angles):
            return (
                model.kinematics(np.concatenate([values[:3], angles, values[6:]])).Ts_world_part[0][:3, :3] - wanted
            ).ravel()

        values[3:6] = least_squares(off, values[3:6]).x
        return values

    def error_mm(self, values):
        """Mean distance of the limb joints from the truth, of those that it has."""
        points = self.model.points_world(values)
        return 1e3 * np.nanmean(
            [np.linalg.norm(points[self.model.point_names.index(n)] - self._places[n]) for n in LIMBS]
        )

    def aim_px(self, joint, camera):
        """Where the user takes a joint to be in a view; another time it is another place."""
        return self._cameras[camera].project(self._places[joint]) + NOISE_PX * self._rng.standard_normal(2)

    def trunk_off_px(self, values, camera):
        """How far the trunk must go in a view, by the eye."""
        points = self.model.points_world(values)
        return np.mean(
            [
                self.aim_px(n, camera) - self._cameras[camera].project(points[self.model.point_names.index(n)])
                for n in TRUNK
            ],
            axis=0,
        )

    def seen_off_px(self, values, joints, aims):
        """Sum of squared distances to what the user aims at, in both views."""
        points = self.model.points_world(values)
        return sum(
            np.sum((self._cameras[c].project(points[self.model.point_names.index(n)]) - aims[n, c]) ** 2)
            for n in joints
            for c in self.views
        )
