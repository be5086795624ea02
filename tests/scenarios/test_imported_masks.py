"""Masks that are imported into a session without any background do what masks given to a new session do."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from observed_people import FPS

from tracker.errors import TrackerError
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording, read_mask
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.pipeline.find_people import FindSettings, find_people
from tracker.session.session import create_session
from tracker.simulate.record import Simulation, simulate

N = 8


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A recording with true masks, a session with them, and one with neither masks nor background."""
    folder = tmp_path_factory.mktemp("masks")
    scene = simulate(folder / "scene", Simulation(n_frames=N, seed=5, size=(320, 240), masks=True))
    bare = [replace(c, background=None, masks=None) for c in scene.cameras]
    masked = [replace(c, background=None) for c in scene.cameras]
    sessions = [
        create_session(folder / name, cameras=cameras, people=scene.people, fps=scene.fps, n_frames=N)
        for name, cameras in (("given", masked), ("bare", bare))
    ]
    return scene, *sessions


def found(session, frames=range(N)):
    with Recording(session.cameras) as footage:
        return find_people(session, Observer(session.cameras, footage), (0,), frames, FindSettings())


@pytest.mark.slow
def test_people_are_found_by_imported_masks_as_by_given_ones(made):
    scene, given, bare = made
    with pytest.raises(TrackerError, match="somebody in the silhouettes"):
        found(bare, range(2))
    plan = plan_import(bare, ImportRequest("net", (scene.folder / "masks",), (), values={scene.people[0].name: 1}))
    assert not plan.problems
    imported = store_import(bare, plan)
    for one, other in zip(imported.cameras, given.cameras, strict=True):
        assert all(np.array_equal(read_mask(one, k), read_mask(other, k)) for k in range(N))
    first, same = found(imported), found(given)
    assert first.frame == same.frame
    assert np.abs(first.poses[0].start.body.values - same.poses[0].start.body.values).max() < 1e-6
    joints = read_joints(scene.folder / "truth.trc", FPS)
    body = first.poses[0].start.body
    centers = dict(zip(body.model.point_names, body.joint_centers_world, strict=True))
    off = [np.linalg.norm(joints.points[first.frame, joints.names.index(j)] - centers[j]) for j in LIMB_JOINTS]
    sys.stderr.write(f"mean error of the first pose {1000 * np.mean(off):.1f} mm\n")
    assert np.mean(off) < 0.06
