"""The paper's minimization: its Jacobian against the reference, and what it reaches from a pose nearby."""

import numpy as np
import pytest
from krh08_reference import Cone, ZeroReference, distance, project, ruling
from staging import cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.contours.occluding_contours import trace
from tracker.experiments.contour_experiment import ContourExperiment, make_scene
from tracker.experiments.convergence import BACK, measure_convergence
from tracker.experiments.extremal_fit import MAX_ITERATIONS, fit_extremal_contours, linearize
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

BODY = load_model("knossow54", 1.75)


def cone_pose(values, part):
    """T_world_cone: the cone's frame lies at the centre of the part's shape."""
    return BODY.kinematics(values).Ts_world_part[part] @ rigid.transform(t=BODY.centers_part[part])


@pytest.mark.parametrize("sliding", [True, False])
def test_the_papers_minimization_has_the_references_jacobian(sliding):
    """Each row of its Jacobian is the slope of the distance image times J_I (A + B) J_H, with or without B."""
    body, cameras = PosedBody(BODY, posed(BODY, 2)), cameras_around(2)
    shifted = body.values.copy()
    shifted[:2] += 0.02
    views = own_evidence([PosedBody(BODY, shifted)], cameras)
    found, reference, checked = linearize(BODY, body.values, views, sliding), ZeroReference(BODY, np.zeros(6)), 0
    first = 0
    for view in views:
        seen = trace([body], view.camera)
        visible = ~seen.occluded
        for point, part in zip(seen.points_world[visible].astype(float), seen.parts[visible], strict=True):
            T, half = cone_pose(body.values, part), BODY.shapes[part].half_axes
            own = rigid.apply(rigid.inverse(T), point)
            cone = Cone.of(BODY.shapes[part])
            if abs(own[2]) < 0.99 * half[2]:
                theta = np.arctan2(own[1] / cone.b, own[0] / cone.a)
                r = ruling(cone, T, view.camera, theta, own[2])
                slope = distance(view.distance.astype(float), project(view.camera, point))[1]
                if np.linalg.norm(r.point_world - point) < 1e-5 and np.linalg.norm(slope) > 0.1 and not r.singular:
                    row = slope @ r.J_I @ (r.A + sliding * r.B) @ reference.J_H(body.values, part)
                    np.testing.assert_allclose(found.jacobian[first], row, atol=1e-3 * np.abs(row).max())
                    checked += 1
            first += 1
    assert first == len(found.distances)
    assert checked > 100


def test_it_comes_near_the_contours_within_the_joint_limits():
    body, cameras = PosedBody(BODY, posed(BODY, 4)), cameras_around(4)
    start = body.values.copy()
    start[:3] += [0.03, -0.02, 0.02]
    found = fit_extremal_contours(BODY, start, own_evidence([body], cameras))
    assert 1 <= found.iterations <= MAX_ITERATIONS
    assert list(found.rms_px) == sorted(found.rms_px, reverse=True)
    assert found.rms_px[-1] < 0.2 * found.rms_px[0]
    np.testing.assert_array_equal(BODY.clip(found.pose), found.pose)


def test_a_body_that_no_view_shows_stays_where_it_is():
    views = own_evidence([PosedBody(BODY, BODY.neutral())], cameras_around(1))
    away = BODY.neutral()
    away[2] = 50.0
    found = fit_extremal_contours(BODY, away, views)
    np.testing.assert_array_equal(found.pose, away)
    assert found.iterations == 0


def test_both_kinds_of_fits_begin_at_the_same_poses():
    scene = make_scene(ContourExperiment(n_frames=5, n_cameras=2, camera_counts=(2,)), "own shape", 2)
    found = {(c.back, c.sliding): c for c in measure_convergence(scene)}
    assert found.keys() == {(back, on) for back in BACK for on in (True, False)}
    for back in BACK:
        assert found[back, True].mean_rms_px[0] == found[back, False].mean_rms_px[0]
        assert len(found[back, True].mean_rms_px) == MAX_ITERATIONS + 1
        assert found[back, True].mean_iterations >= 1
