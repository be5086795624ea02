"""Two people of one size, who were out of all views, come back in each other's place: their clothes decide."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.evaluation.references import read_joints
from tracker.simulate import Simulation, simulate
from tracker.simulate.motion import scenes
from tracker.simulate.motion.postures import Role
from tracker.simulate.people.outfit import GREEN, RED

FPS, AWAY = 5.0, range(6, 9)


def walks_at(side):
    """Walks on the spot at one side, is below the floor for a while, and then at the other side."""

    def act(model, t):
        k, posture = round(t * FPS), scenes.walk_in_place(model, t)
        step = np.array([0.0, side * (0.7 if k < AWAY.start else -0.7), -30.0 * (k in AWAY)])
        feet = {name: tuple(np.array(foot) + step) for name, foot in posture.feet_m.items()}
        return replace(posture, trunk_m=tuple(np.array(posture.trunk_m) + step), feet_m=feet)

    return act


@pytest.mark.slow
def test_people_who_come_back_in_each_others_place(tmp_path, monkeypatch, detected):
    looks = {"ann": (1, RED), "ben": (-1, GREEN)}
    cast = tuple(Role(n, 1.75, walks_at(side), outfit=outfit) for n, (side, outfit) in looks.items())
    monkeypatch.setattr(scenes, "SCENES", {"exchange": lambda seed: cast})
    session = simulate(tmp_path / "s", Simulation("exchange", 4, 15, 7, fps=FPS))
    observations, found = detected(session, range(15))
    true = [read_joints(session.folder / f"truth_{who}.trc", FPS) for who in looks]
    column = found.names.index(observations.joint_map.markers["left_hip"])
    hips = found.joints_world[:, :, column]
    apart = np.array([[hips[:, p] - t.points[:, t.names.index("left_hip")] for t in true] for p in (0, 1)])
    is_there = np.linalg.norm(apart, axis=-1) < 0.3
    seen = [k for k in range(15) if k not in AWAY]
    ways = is_there[[0, 1], [0, 1]][:, seen].all() or is_there[[0, 1], [1, 0]][:, seen].all()
    figures = observations.points.is_known.any(axis=-1).sum(axis=-1)  # of each frame in each view
    assert ways, (figures[seen].tolist(), np.round(hips[seen], 2).tolist())
