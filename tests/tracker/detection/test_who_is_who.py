"""Two people of one size, who were out of all views, come back in each other's place: their clothes tell who is who."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tracker.detection.detect import DetectionPlan, detect_people
from tracker.detection.detectors import load_detector
from tracker.detection.model_files import MODEL_FILES, default_folder
from tracker.evaluation.references import read_joints
from tracker.footage.recording import Recording
from tracker.observations.joints import triangulate_observations
from tracker.observations.stored import load_observations
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
def test_people_who_come_back_in_each_others_place(tmp_path, monkeypatch):
    pytest.importorskip("ai_edge_litert")
    folder = Path(os.environ.get("QUADRILLE_MODELS") or default_folder())
    if not all((folder / name).is_file() for name in MODEL_FILES):
        pytest.skip(f"expected the networks in {folder}: quadrille detect --get-models fetches them")
    looks = {"ann": (1, RED), "ben": (-1, GREEN)}
    cast = tuple(Role(n, 1.75, walks_at(side), outfit=outfit) for n, (side, outfit) in looks.items())
    monkeypatch.setattr(scenes, "SCENES", {"exchange": lambda seed: cast})
    session = simulate(tmp_path / "s", Simulation("exchange", 4, 15, 7, fps=FPS))
    detector, name = load_detector("blazepose", "heavy", folder)
    with Recording(session.cameras) as recording:
        detect_people(session, recording, detector, DetectionPlan("net", name, range(15)))
    observations = load_observations(session, "net")
    found = triangulate_observations(observations, [c.camera for c in session.cameras]).joints
    true = [read_joints(session.folder / f"truth_{who}.trc", FPS) for who in looks]
    column = found.names.index(observations.joint_map.markers["left_hip"])
    hips = found.joints_world[:, :, column]
    apart = np.array([[hips[:, p] - t.points[:, t.names.index("left_hip")] for t in true] for p in (0, 1)])
    is_there = np.linalg.norm(apart, axis=-1) < 0.3
    seen = [k for k in range(15) if k not in AWAY]
    assert is_there[[0, 1], [0, 1]][:, seen].all() or is_there[[0, 1], [1, 0]][:, seen].all()
