"""Residuals of key points: derivatives, gross errors, views of other times."""

from types import SimpleNamespace

import numpy as np
import pytest
from finite_differences import normal, slopes
from staging import cameras_around, posed

from tracker.body.model import PosedBody
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS, KeypointBlock, keypoint_blocks
from tracker.evidence.keypoints import KeypointEvidence, PersonKeypoints, ViewKeypoints
from tracker.formats.model_toml import load_model

CAMERAS, MODEL, SIGMA_PX = cameras_around(3), load_model("gavrila38"), 4.0
PARTS = MODEL.proximal_parts
PLACES = np.random.default_rng(3).normal(0, 0.03, (len(PARTS), 3))


def seen(pose, off_px=0.0):
    """Where each camera has the points of a body in a pose."""
    T = PosedBody(MODEL, pose).kinematics.Ts_world_part[PARTS]
    world = np.einsum("nij,nj->ni", T[:, :3, :3], PLACES) + T[:, :3, 3]
    return [ViewKeypoints(PARTS, PLACES, c.project(world) + off_px, np.full(len(PARTS), SIGMA_PX)) for c in CAMERAS]


def block_of(views):
    return KeypointBlock.of(list(zip(CAMERAS, views, strict=True)))


def cost(block, pose):
    return normal(block, PosedBody(MODEL, pose)).cost


def test_arguments_of_kernels_are_contiguous():
    """Kernels are compiled again for each order in memory, which takes twenty seconds."""
    block = block_of(seen(MODEL.neutral()))
    assert [a.flags.c_contiguous for a in block.arrays] == [True] * 5


def test_the_gradient_is_the_derivative_of_the_cost():
    pose = posed(MODEL, 2)
    block = block_of(seen(MODEL.retract(pose, np.random.default_rng(0).normal(0, 0.1, MODEL.n_dofs))))
    found = normal(block, PosedBody(MODEL, pose)).gradient
    expected = slopes(lambda b: normal(block, b).cost, PosedBody(MODEL, pose))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-3 * np.abs(found).max())


def test_a_small_error_costs_its_square_and_a_gross_one_is_bounded():
    pose, n = posed(MODEL, 2), 3 * len(PARTS)
    assert cost(block_of(seen(pose, [0.1 * SIGMA_PX, 0.0])), pose) == pytest.approx(0.5 * n * 0.1**2, rel=0.01)
    assert cost(block_of(seen(pose, [1e4, 0.0])), pose) == pytest.approx(0.5 * n * GROSS_SIGMAS**2, rel=0.01)


def test_a_wrong_view_of_a_wrist_does_not_move_it():
    pose = posed(MODEL, 2)
    views, wrist = seen(pose), MODEL.point_names.index("left_wrist")
    views[0].positions_px[wrist] += (150.0, 80.0)
    start = MODEL.retract(pose, np.full(MODEL.n_dofs, 0.02))
    found = solve(MODEL, start, [block_of(views), PosePrior(start, np.full(MODEL.n_dofs, 0.1))]).pose
    off = np.linalg.norm(MODEL.points_world(found) - MODEL.points_world(pose), axis=1)
    assert off[wrist] < 0.005


def test_a_late_view_sees_the_body_later():
    pose, velocity = posed(MODEL, 2), np.full(MODEL.n_dofs, 0.05)
    views = [
        SimpleNamespace(camera=c, keypoints=(None, k), ahead_frames=t)
        for c, k, t in zip(CAMERAS, seen(MODEL.retract(pose, 0.5 * velocity)), (0.5, 0.5, 0.5), strict=True)
    ]
    assert keypoint_blocks(views, 0, velocity) == []
    (block,) = keypoint_blocks(views, 1, velocity)
    assert cost(block, pose) == pytest.approx(0.0, abs=1e-6)
    (unmoved,) = keypoint_blocks(views, 1, None)
    assert cost(unmoved, pose) > 10


def test_a_cropped_view_has_the_pixels_of_its_region():
    camera, normalized = CAMERAS[0], np.array([[0.1, -0.05], [np.nan, np.nan]])
    person = PersonKeypoints(
        np.array([1, 2]), np.zeros((2, 3)), normalized[None, None], np.full((1, 1, 2), 1 / camera.K[0, 0])
    )
    found = KeypointEvidence((None, person)).of_views([0]).in_view(0, 0, camera.cropped((100, 50, 400, 300)))
    assert found[0] is None
    expected = camera.K[:2, :2] @ normalized[0] + camera.K[:2, 2] - (100, 50)
    np.testing.assert_allclose(found[1].positions_px, [expected])
    np.testing.assert_allclose(found[1].sigmas_px, [1.0])
