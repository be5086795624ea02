"""Sizes from voxels: a person of another shape than the body, seen by eight cameras with pixels that are wrong."""

import cv2
import numpy as np
import pytest
from solids import cameras_around

from tracker.body.dimensions import dimensions_of, stature_m, with_dimensions
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_voxels import SilhouettedPerson, VoxelSizeSettings, fit_sizes_to_voxels
from tracker.estimation.acquisition.part_derivatives import figure_by_sizes, parts_by_unknowns, points_by_sizes
from tracker.estimation.acquisition.size_fit import SizeFitSettings, fit_sizes_to_contours
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.evidence.contours.label_image import part_labels
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

CAMERAS = cameras_around(6, focal=260.0)


def person_of(stoutness):
    """A person 1.66 m tall, thicker or thinner than the preset of another model."""
    sizes = dimensions_of(load_model("gavrila34", 1.66))
    parts = {
        n: p._replace(girths_m=(p.girths_m[0] * stoutness, p.girths_m[1] * stoutness)) for n, p in sizes.parts.items()
    }
    return with_dimensions(load_model("gavrila34", 1.66), sizes._replace(parts=parts))


def posed(person, seed):
    """A person near the origin with arms and legs apart."""
    rng, pose = np.random.default_rng(seed), person.neutral()
    by_name = {n: i for i, n in enumerate(person.value_names)}
    for name, i in by_name.items():
        if name.endswith("shoulder.abduction") or name.endswith("hip.abduction"):
            pose[i] = 0.7 if "shoulder" in name else 0.2
        elif "elbow" in name or "knee" in name:
            pose[i] = 0.4 * abs(rng.normal())
    pose[:3] = 0.0, 0.0, 0.0
    points = person.points_world(pose)
    pose[:3] -= points.mean(axis=0)
    return person.clip(pose)


def silhouettes(person, pose, rng, cameras=CAMERAS):
    """The person's silhouettes, in which one border pixel in five is wrong."""
    found = []
    for camera in cameras:
        mask = (part_labels([PosedBody(person, pose)], camera) > 0).view(np.uint8)
        border = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
        wrong = border & (rng.random(mask.shape) < 0.2)
        found.append(ViewSilhouette((mask > 0) ^ wrong, camera, 1.0, "mask"))
    return tuple(found)


def frames_of(person, model, n):
    """Frames of a person, on which the body stands at the person's limb joints, as well as it can."""
    found = []
    for seed in range(n):
        rng, pose = np.random.default_rng(seed), posed(person, seed)
        at = person.named_points_world(pose)
        start = fit_to_points(model, {j: at[j] + rng.normal(0, 0.01, 3) for j in LIMB_JOINTS}).pose
        found.append(SilhouettedPerson(seed, silhouettes(person, pose, rng), (PosedBody(model, start),)))
    return found


def girths(body):
    parts = dimensions_of(body).parts
    return np.array([np.mean(parts[p].girths_m) for p in ("left_upper_arm", "left_forearm", "left_thigh", "left_calf")])


@pytest.mark.slow
@pytest.mark.parametrize("stoutness", [1.2, 0.85])
def test_height_and_girths_of_a_person_are_found(stoutness):
    person, model = person_of(stoutness), load_model("gavrila22", 1.78)
    fit = fit_sizes_to_voxels(SizeParameters(model), frames_of(person, model, 4), VoxelSizeSettings())
    assert abs(fit.body.height_m / stature_m(person) - 1) < 0.03
    was, now = (np.abs(girths(b) / girths(person) - 1) for b in (model, fit.body))
    assert now.mean() < 0.04 < was.mean()
    assert fit.overlap_after > fit.overlap_before + 0.05


@pytest.mark.slow
def test_derivatives_agree_with_differences():
    model = load_model("gavrila34", 1.7)
    parameters = SizeParameters(model)
    sizes, rng = np.zeros(len(parameters.names)), np.random.default_rng(2)
    pose = model.clip(model.retract(posed(model, 1), rng.normal(0, 0.15, model.n_dofs)))
    settings = VoxelSettings()

    def figure(own_sizes, own_pose):
        body = PosedBody(parameters.body(own_sizes), own_pose)
        return body, state_of(body.model, [own_pose], 1.0, settings)

    body, state = figure(sizes, pose)
    by_points = points_by_sizes(model, body.kinematics, parameters.derivatives(sizes))
    J = parts_by_unknowns(body, state, figure_by_sizes(parameters, sizes), by_points)
    step, n = 1e-5, len(sizes)
    for dof in range(model.n_dofs):
        moved = figure(sizes, model.retract(pose, step * np.eye(model.n_dofs)[dof]))[1]
        turns = rigid.so3_log(np.swapaxes(state.rotations, 1, 2) @ moved.rotations) / step
        np.testing.assert_allclose(J[:, 3:6, n + dof], turns, atol=1e-4)
    for k in np.flatnonzero(parameters.of_kinds("height", "length", "girth", "free_end")):
        moved = figure(sizes + step * np.eye(n)[k], pose)[1]
        np.testing.assert_allclose(J[:, 6:, k], (moved.sizes - state.sizes) / step, atol=1e-4)


def test_the_fit_to_contours_starts_there():
    person, model = person_of(1.2), load_model("gavrila22", 1.78)
    parameters = SizeParameters(model)
    fit = fit_sizes_to_voxels(parameters, frames_of(person, model, 1), VoxelSizeSettings(rounds=1))
    same = fit_sizes_to_contours(parameters, [], SizeFitSettings(rounds=()), fit.start)
    np.testing.assert_array_equal(same.sizes, fit.sizes)
    np.testing.assert_array_equal(same.covariance, fit.covariance)
    assert same.n_evaluations == 0
    assert set(fit.start.poses) == {0}


def test_nobody_is_seen():
    person, model = person_of(1.0), load_model("gavrila22", 1.78)
    (frame,) = frames_of(person, model, 1)
    empty = tuple(s._replace(mask=np.zeros_like(s.mask)) for s in frame.silhouettes)
    with pytest.raises(TrackerError, match="expected voxels of the person on frames 0, found none"):
        fit_sizes_to_voxels(SizeParameters(model), [frame._replace(silhouettes=empty)], VoxelSizeSettings())
