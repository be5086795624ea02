"""Standard deviations from contours: against the residuals that track, and as a person would expect."""

import numpy as np
import pytest
from scipy.stats import spearmanr
from staging import camera_at, cameras_around, own_evidence, posed

from tracker.body.model import PosedBody
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.fitting.added_camera import rank_added_cameras
from tracker.estimation.fitting.contour_residuals import ContourResiduals, MatchSettings
from tracker.estimation.fitting.observability import OBSERVABLE_RAD, ContourNoise, observe_pose
from tracker.estimation.fitting.observability_reasons import describe_all
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.evidence.observer import open_observer
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table
from tracker.simulate import Simulation, simulate

MODEL = load_model("gavrila34", 1.75)
NAMES = MODEL.dof_names
UP = np.array([0.0, 0.0, 1.0])
ACQUIRED = ContourNoise(joint_share=0.002)
"""A body whose sizes are those of the person."""


def standing(**degrees):
    """The default pose with some angles, names with two underscores for the point."""
    values = MODEL.neutral()
    for name, angle in degrees.items():
        values[NAMES.index(name.replace("__", "."))] = np.radians(angle)
    return PosedBody(MODEL, values)


def sentence(body, cameras, dof, noise=None):
    observability = observe_pose([body], cameras, noise=noise)
    return describe_all([body], cameras, observability, noise=noise)[NAMES.index(dof)]


def test_the_normal_matrix_is_that_of_the_contour_residuals():
    """Where all contours lie on edges, the image-to-model residuals have the same second derivative, per length."""
    body, cameras = PosedBody(MODEL, posed(MODEL, 2)), cameras_around(3)
    match = MatchSettings(model_to_image=0.0, image_to_model=1.0, scale=100.0)
    noise = ContourNoise(1.0, 1 / match.information_per_px, joint_share=0.0)
    residuals = ContourResiduals(own_evidence([body], cameras), [body], 0, match)
    expected = residuals.linearize(MODEL, body.values, body.kinematics).hessian
    found = observe_pose([body], cameras, noise=noise).information.matrices.sum(axis=0)
    scale = np.sqrt(np.diag(expected))
    # Points stand on whole pixels, one in each cell of 2 px that a contour meets: slanted contours meet more of them.
    ratios = np.diag(found) / scale**2
    assert 0.7 < ratios.min() <= ratios.max() < 1.1
    assert np.abs(found / np.outer(scale, scale) / ratios.mean() - expected / np.outer(scale, scale)).max() < 0.3


def test_variance_falls_with_the_noise():
    body, cameras = standing(), cameras_around(3)
    quiet, loud = (observe_pose([body], cameras, noise=ContourNoise(s, 4.0)) for s in (0.5, 1.0))
    np.testing.assert_allclose(4 * loud.information.matrices, quiet.information.matrices)
    assert np.all(quiet.sigmas < loud.sigmas)
    assert quiet.rank == MODEL.n_dofs
    assert quiet.condition > 10


def test_unknown_sizes_count():
    """Where bones may have other lengths, angles are known less well."""
    body, cameras = standing(), cameras_around(3)
    known, unknown = (observe_pose([body], cameras, noise=ContourNoise(joint_share=s)).sigmas for s in (0.0, 0.012))
    assert np.all(unknown >= known)
    assert np.all(unknown[:3] >= 0.012 * MODEL.height_m)  # where the root lies in the trunk
    assert np.median(unknown[6:] / known[6:]) > 1.05


def test_the_twist_of_a_straight_arm_is_not_observable():
    """A cone of revolution looks alike however it is turned; the forearm of a bent elbow swings."""
    cameras, dof = cameras_around(6), NAMES.index("left_shoulder.twist")
    straight, bent = standing(), standing(left_elbow__extension=80)
    found = [observe_pose([b], cameras, noise=ACQUIRED) for b in (straight, bent)]
    assert found[0].sigmas[dof] > np.radians(40) > OBSERVABLE_RAD > found[1].sigmas[dof]
    assert [bool(o.is_observable[dof]) for o in found] == [False, True]
    expected = "twist of the left shoulder: not observable while the left elbow is straight"
    assert sentence(straight, cameras, "left_shoulder.twist", ACQUIRED) == expected
    assert sentence(bent, cameras, "left_shoulder.twist", ACQUIRED).startswith("twist of the left shoulder: known to ")


def test_a_limb_that_no_view_shows():
    """A camera that looks at the head alone."""
    body = standing()
    head = body.points_world[MODEL.point_names.index("head")]
    cameras = [camera_at("near", head + np.array([0.5, 0, 0]), head, focal=2000.0)]
    told = sentence(body, cameras, "left_knee.extension")
    assert told == "extension of the left knee: not observable, because no view shows left calf"


def test_parameters_held_by_the_prior_alone_are_not_observable():
    body, cameras = standing(), [camera_at("front", (4.0, 0.0, 0.6))]
    observability = observe_pose([body], cameras)
    dof = NAMES.index("spine.elevation")  # a forward bend is along the only line of sight
    assert observability.sigmas[dof] > 0.8 * MODEL.spreads[dof]
    assert not observability.is_observable[dof]
    told = sentence(body, cameras, "spine.elevation")
    assert told.startswith("elevation of the spine: not observable")


def test_the_view_that_is_missed_most():
    """A forward bend shows from the side, not from the front."""
    cameras = [camera_at("front", (4.0, 0.0, 0.6)), camera_at("side", (0.0, 4.0, 0.6))]
    observability = observe_pose([standing()], cameras)
    assert cameras[observability.best_views[NAMES.index("left_hip.flexion")]].name == "side"
    assert cameras[observability.best_views[NAMES.index("left_shoulder.abduction")]].name == "front"


def test_another_person_in_front_hides_a_body():
    other = standing()
    other.values[:3] += [1.0, 0.0, 0.0]
    cameras = [camera_at("front", (4.0, 0.0, 0.6)), camera_at("side", (0.0, 4.0, 0.6))]
    alone, behind = (observe_pose(b, cameras) for b in ([standing()], [standing(), other]))
    assert behind.information.lengths_px[0].sum() < 0.5 * alone.information.lengths_px[0].sum()
    assert behind.sigmas.mean() > alone.sigmas.mean()


def test_a_second_camera_helps_most_from_the_side():
    """Seen from the front alone, a camera to the side tells most, and one behind them next to nothing."""
    body = standing()
    ranked = rank_added_cameras([[body]], [camera_at("front", (4.0, 0.0, 0.0))], UP)
    best, worst = ranked[0], ranked[-1]
    assert all(c.mean_after <= c.mean_before for c in ranked)
    assert abs(np.sin(best.direction_rad)) > 0.6
    level = [c for c in ranked if c.elevation_rad == 0]
    assert abs(np.sin(level[-1].direction_rad)) < 0.1
    assert best.mean_before - best.mean_after > 2 * (worst.mean_before - worst.mean_after)
    np.testing.assert_allclose(np.linalg.norm(best.camera.center_world - body.points_world.mean(axis=0)), 4.0, rtol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gavrila22", "knossow54"])
def test_every_degree_of_freedom_has_a_sentence(name):
    model = load_model(name, 1.7)
    body, cameras = PosedBody(model, posed(model, 1)), cameras_around(2)
    told = describe_all([body], cameras, observe_pose([body], cameras))
    assert len(told) == model.n_dofs
    assert all(": known to " in t or ": not observable" in t for t in told)
    assert len(set(told)) == len(told)


def test_finite_where_a_part_surrounds_the_camera():
    body = standing()
    observability = observe_pose([body], [camera_at("inside", body.points_world[0] + 0.01, (5.0, 5.0, 5.0))])
    assert np.all(np.isfinite(observability.sigmas))
    assert observability.rank <= MODEL.n_dofs


@pytest.mark.slow
def test_predicted_and_real_errors_of_a_person_that_nothing_was_fitted_to(tmp_path):
    """One of the people that docs/measurements.md checks; `tests/benchmarks/observability.py` has all of them."""
    session = simulate(tmp_path / "s", Simulation("exercise", n_frames=36, seed=9, person="broad_man"))
    model = session.people[0].model
    truth = read_pose_table(tmp_path / "s" / "truth.csv").values_for(model)
    with open_observer(session.cameras) as observer:
        run = TrackingRun(observer, Subjects.of([model]), [truth[0]], range(36), session.fps)
        poses = [e.poses[0] for e in ChamferTracker().estimates(run)]
    found = [observe_pose([PosedBody(model, p)], observer.working_cameras) for p in poses]
    sigmas, observable = np.array([o.sigmas for o in found]), np.array([o.is_observable for o in found])
    errors = np.abs([model.difference(p, t) for p, t in zip(poses, truth, strict=True)])
    angles = ~model.dof_is_length
    rms = [np.sqrt((a[:, angles] ** 2).mean(axis=0)) for a in (sigmas, errors)]
    assert spearmanr(*rms)[0] > 0.6
    assert spearmanr(sigmas[:, angles].ravel(), errors[:, angles].ravel())[0] > 0.5
    assert (errors > 3 * sigmas)[observable].mean() < 0.05
    assert observable.mean() > 0.5
