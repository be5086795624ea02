"""Label images against rays that meet spheres, and against traced contours."""

import cv2
import numpy as np
from fisheye import with_fisheye
from staging import SIZE, at, camera_at, solid

from tracker.evidence.contours.label_image import part_labels

FRONT = camera_at("front", (4.0, 0.0, 0.0))
RADIUS = 0.2


def met_first(centers, camera):
    """1 + the index of the sphere of RADIUS that the ray through each pixel meets first; 0 for none, (H, W)."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T @ camera.T_world_camera[:3, :3].T
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    towards = np.array(centers) - camera.center_world  # (n, 3)
    along = rays @ towards.T  # (H, W, n)
    inside = RADIUS**2 - (np.sum(towards**2, axis=-1) - along**2)
    depths = np.where(inside > 0, along - np.sqrt(np.maximum(0, inside)), np.inf)
    return np.where(np.isfinite(depths.min(axis=-1)), 1 + depths.argmin(axis=-1), 0)


def test_the_nearer_of_two_bodies_is_seen_and_where_they_meet_the_surface_decides():
    # One stands half before the other, a third cuts into the second.
    centers = [(0.6, -0.1, 0.0), (0.0, 0.05, 0.0), (0.05, 0.3, 0.1)]
    model = solid((RADIUS,) * 3)
    labels = part_labels([at(model, *c) for c in centers], FRONT)
    expected = met_first(centers, FRONT)
    assert set(np.unique(expected)) == {0, 1, 2, 3}
    # The mesh's chords lie up to 2% of the radius, half a pixel, within the spheres.
    borders = cv2.dilate(
        (cv2.Laplacian(expected.astype(np.float32), cv2.CV_32F) != 0).astype(np.uint8), np.ones((3, 3))
    )
    assert np.all((labels == expected) | (borders > 0))
    assert np.mean(labels != expected) < 0.002


def test_a_fisheye_is_labelled_in_its_undistorted_picture():
    camera, model = with_fisheye(FRONT), solid((RADIUS,) * 3)
    labels = part_labels([at(model, 0.0, 0.8, 0.0)], camera)
    assert labels.shape == (camera.pinhole.height, camera.pinhole.width)
    np.testing.assert_array_equal(labels, part_labels([at(model, 0.0, 0.8, 0.0)], camera.pinhole))
    expected = met_first([(0.0, 0.8, 0.0)], camera.pinhole)
    assert np.mean(labels != expected) < 0.002


def test_points_outside_the_image_or_behind_are_left_out():
    model = solid((RADIUS,) * 3)
    assert not part_labels([at(model, 8.0, 0.0, 0.0)], FRONT).any()
    assert not part_labels([at(model, 0.0, 90.0, 0.0)], FRONT).any()
    at_the_edge = part_labels([at(model, 0.0, 2.4, 0.0)], FRONT)
    assert at_the_edge[:, -1].any() != at_the_edge[:, 0].any()
    assert at_the_edge.shape == SIZE[::-1]
    around_the_eye = part_labels([at(model, 4.0, 0.0, 0.0)], FRONT)
    assert around_the_eye.max() <= 1
