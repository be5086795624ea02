"""Files of an export are imported as files of other programs are."""

import numpy as np
import pytest
from bodies import MODELS
from stored_motions import store_motion

from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.interchange.exports.formats import FORMATS as EXPORTS
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.observed import columns_of, observed_joints
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.readers import FORMATS
from tracker.interchange.observations.stored import load_observations

N = 8
ALONE = ("trc", "bvh", "c3d")
"""Formats with a file for each person."""


@pytest.mark.parametrize(
    "name", [*ALONE, "csv", *(pytest.param(name, marks=pytest.mark.slow) for name in ("coco", "openpose"))]
)
def test_exported_people_are_read_back(tmp_path, name):
    if name == "c3d":
        pytest.importorskip("ezc3d")
    session, truth = store_motion(tmp_path / "s", [MODELS["gavrila34"]] * 2, n_frames=N)
    paths = []
    for people in ((0,), (1,)) if name in ALONE else ((0, 1),):
        own = [tmp_path / f"{people[0]}{suffix}" for suffix in EXPORTS[name].suffixes]
        options = ExportOptions("calibration", "mm" if name == "c3d" else "m")
        EXPORTS[name].write(read_motion(session, people), options, own, lambda: None)
        paths += own[:1]
    choices = {"bvh": {"unit_m": 1.0}, "coco": {"confidence": 1.0}}.get(name, {})  # which these files do not state
    plan = plan_import(session, ImportRequest("back", tuple(paths), ("ann", "bob"), **choices))
    store_import(session, plan)
    observations = load_observations(session, "back")
    assert observations.format in FORMATS
    joints = observed_joints(observations, [c.camera for c in session.cameras])
    columns = columns_of(joints.names, observations.joint_map, LIMB_JOINTS)
    is_there = columns >= 0
    assert is_there.sum() == (8 if name == "bvh" else 12)  # BVH has ends of chains without names
    for k, bodies in enumerate(truth):
        centers = np.array([body.joint_centers_world for body in bodies.values()])
        own = [bodies[0].model.point_names.index(joint) for joint in LIMB_JOINTS]
        apart = np.linalg.norm(joints.joints_world[:, k, columns] - centers[:, own], axis=-1)[:, is_there]
        assert np.isfinite(apart).mean() > 0.9
        assert np.nanmax(apart) < 1e-3
