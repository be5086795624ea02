"""Smoothing of noisy poses of a simulated motion."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import MODELS

from tracker.compute.progress import result_of
from tracker.formats.model_toml import load_model
from tracker.motion.shortest_step import unwrapped_path
from tracker.trajectory.pose_track import PoseTrack, smooth_poses

FPS = 30.0
MODEL = load_model("gavrila34", 1.68)


def motion(model, n, seed=0, reach_rad=0.4):
    """A smooth motion of every degree of freedom, slow waves of different periods, (n, n_values)."""
    rng = np.random.default_rng(seed)
    periods, phases = rng.uniform(1.0, 2.5, model.n_dofs), rng.uniform(0, 2 * np.pi, model.n_dofs)
    t = np.arange(n)[:, None] / FPS
    reach = np.where(model.dof_is_length, 0.2, reach_rad)
    steps = reach * (1 + np.sin(2 * np.pi * t / periods + phases))
    return np.array([model.clip(model.retract(model.neutral(), s)) for s in steps])


def noisy(model, truth, seed=1, sigma_rad=0.03, fixed=()):
    """Poses with white noise of a covariance that couples the degrees of freedom, and the track that knows it."""
    rng, n = np.random.default_rng(seed), model.n_dofs
    A = rng.normal(size=(n, n))
    sigma = np.where(model.dof_is_length, 0.005, sigma_rad)
    shape = A @ A.T / n + np.eye(n)
    C = shape / np.sqrt(np.outer(np.diag(shape), np.diag(shape))) * np.outer(sigma, sigma)
    noise = rng.multivariate_normal(np.zeros(n), C, len(truth))
    exact = np.isin(np.arange(len(truth)), fixed)
    poses = np.array([v if e else model.clip(model.retract(v, d)) for v, d, e in zip(truth, noise, exact, strict=True)])
    covariances = np.broadcast_to(C, (len(truth), n, n))
    trusted = np.ones((len(truth), n), dtype=bool)
    return PoseTrack(model, np.arange(len(truth)) / FPS, poses, covariances, exact, trusted)


def smoothed(track):
    return result_of(smooth_poses(track))


def points(model, poses):
    return np.array([model.points_world(v) for v in poses])


def errors(model, poses, truth):
    """Mean distance of the points, metres, and mean acceleration of the error, m/s^2."""
    error = points(model, poses) - points(model, truth)
    acceleration = np.diff(error, n=2, axis=0) * FPS**2
    return np.linalg.norm(error, axis=-1).mean(), np.linalg.norm(acceleration, axis=-1).mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gavrila34", "gavrila22", "balls"])
def test_noise_falls_and_its_acceleration_more(name):
    model = MODELS[name]
    truth = motion(model, 40)
    track = noisy(model, truth)
    (before_m, before_a), (after_m, after_a) = (errors(model, p, truth) for p in (track.poses, smoothed(track)))
    assert after_m < 0.75 * before_m
    assert after_a < 0.25 * before_a


@pytest.mark.slow
def test_keyframes_are_bit_identical_and_their_neighbours_follow_them():
    truth = motion(MODEL, 40)
    track = noisy(MODEL, truth, fixed=(0, 17, 39))
    found = smoothed(track)
    for k in (0, 17, 39):
        np.testing.assert_array_equal(found[k], track.poses[k])
    assert not np.array_equal(found[1], track.poses[1])
    of_frames = np.linalg.norm(points(MODEL, found) - points(MODEL, truth), axis=-1).mean(axis=1)
    assert of_frames[[16, 18]].mean() < of_frames[20:36].mean()


@pytest.mark.slow
def test_a_turn_goes_on_through_half_a_turn():
    """Angles that jump by a whole turn are the same rotation."""
    twist = MODEL.dof_names.index("torso.twist")
    truth = np.tile(MODEL.neutral(), (40, 1))
    truth[:, twist] = np.linspace(np.pi - 0.8, np.pi + 0.8, 40)
    track = noisy(MODEL, truth)
    wrapped = track.poses.copy()
    wrapped[:, twist] = np.remainder(wrapped[:, twist] + np.pi, 2 * np.pi) - np.pi
    assert np.abs(np.diff(wrapped[:, twist])).max() > 6
    found = smoothed(PoseTrack(MODEL, track.times_s, wrapped, track.covariances, track.fixed, track.trusted))
    np.testing.assert_allclose(points(MODEL, found), points(MODEL, smoothed(track)), atol=1e-9)
    assert errors(MODEL, found, truth)[1] < 0.25 * errors(MODEL, track.poses, truth)[1]


@pytest.mark.slow
def test_limits_are_kept():
    elbow = MODEL.dof_names.index("left_elbow.extension")
    truth = motion(MODEL, 40)
    truth[:, elbow] = np.abs(np.linspace(-0.3, 0.3, 40))  # touches its limit of 0
    found = smoothed(noisy(MODEL, truth, sigma_rad=0.05))
    low, high = MODEL.limits.T
    assert (found >= low).all()
    assert (found <= high).all()


@pytest.mark.slow
def test_a_lost_limb_follows_its_motion_before_and_after():
    truth = motion(MODEL, 40)
    track = noisy(MODEL, truth)
    arm = np.array([n.startswith(("left_shoulder", "left_elbow")) for n in MODEL.dof_names])
    track.poses[18:21] = [MODEL.clip(MODEL.retract(v, 1.0 * arm)) for v in track.poses[18:21]]
    wrist = MODEL.point_names.index("left_wrist")

    def off_m(trusted):
        found = smoothed(PoseTrack(MODEL, track.times_s, track.poses, track.covariances, track.fixed, trusted))
        return np.linalg.norm(points(MODEL, found)[:, wrist] - points(MODEL, truth)[:, wrist], axis=-1)[18:21].max()

    lost = track.trusted.copy()
    lost[18:21, arm] = False
    assert off_m(track.trusted) > 0.2
    assert off_m(lost) < 0.05


@pytest.mark.slow
def test_lost_frames_are_interpolated_but_not_extrapolated():
    truth = motion(MODEL, 30)
    track = noisy(MODEL, truth)
    lost = track.trusted.copy()
    for t in (0, 1, 12, 13, 28, 29):
        track.poses[t, :3] += 1.0
        lost[t] = False
    found = smoothed(PoseTrack(MODEL, track.times_s, track.poses, track.covariances, track.fixed, lost))
    for t in (0, 1, 28, 29):
        np.testing.assert_array_equal(found[t], track.poses[t])
    assert np.abs(found[12:14, :3] - truth[12:14, :3]).max() < 0.05


@pytest.mark.slow
def test_a_gap_in_time_counts():
    """Frames two steps apart move twice as far: smoothed at the times they have, they do not lag."""
    truth = motion(MODEL, 50)
    track = noisy(MODEL, truth)
    kept = np.flatnonzero(np.arange(50) % 5 != 3)
    some = PoseTrack(
        MODEL, track.times_s[kept], track.poses[kept], track.covariances[kept], track.fixed[kept], track.trusted[kept]
    )
    (before_m, _), (after_m, _) = (errors(MODEL, p, truth[kept]) for p in (some.poses, smoothed(some)))
    assert after_m < 0.75 * before_m


def test_two_frames_show_no_motion():
    track = noisy(MODEL, motion(MODEL, 2))
    np.testing.assert_array_equal(smoothed(track), track.poses)


def test_a_path_reaches_each_pose():
    poses = motion(MODELS["balls"], 20)
    path, _ = unwrapped_path(MODELS["balls"], poses)
    assert not path[0].any()
    at = poses[0]
    for pose, step in zip(poses[1:], np.diff(path, axis=0), strict=True):
        at = MODELS["balls"].retract(at, step)
        np.testing.assert_allclose(MODELS["balls"].points_world(at), MODELS["balls"].points_world(pose), atol=1e-9)


@pytest.mark.slow
def test_the_other_set_of_angles_changes_nothing():
    """Some poses have the other set of angles of a shoulder; their covariances are of these numbers."""
    shoulder = [MODEL.dof_names.index(f"right_shoulder.{n}") for n in ("abduction", "elevation", "twist")]
    track = noisy(MODEL, motion(MODEL, 30))
    poses, covariances, sign = track.poses.copy(), track.covariances.copy(), np.ones(MODEL.n_dofs)
    sign[shoulder[1]] = -1
    for t in (9, 10, 20):
        a, b, c = poses[t, shoulder]
        poses[t, shoulder] = a - np.pi, np.pi - b, c + np.pi
        covariances[t] *= np.outer(sign, sign)
    wide = replace(MODEL, joints=tuple(map(without_limits, MODEL.joints)))
    flipped = smoothed(replace(track, model=wide, poses=poses, covariances=covariances))
    plain = smoothed(replace(track, model=wide))
    assert np.abs(points(MODEL, flipped) - points(MODEL, plain)).max() < 1e-6


def without_limits(joint):
    """The joint with limits that no pose reaches."""
    return replace(joint, axes=tuple(replace(a, limits=(-9.0, 9.0)) for a in joint.axes))


def test_a_fast_arm_keeps_its_motion():
    """At 8 frames/s an arm swings 1.5 times a second, while nothing else moves. No point moves by more than the
    standard deviation of the measurement of an outstretched arm."""
    shoulder = MODEL.dof_names.index("right_shoulder.elevation")
    truth = np.tile(MODEL.neutral(), (24, 1))
    truth[:, shoulder] = 0.5 + 0.5 * np.sin(2 * np.pi * 1.5 * np.arange(24) / 8)
    track = replace(noisy(MODEL, truth, sigma_rad=0.03), poses=truth, times_s=np.arange(24) / 8)
    swings = points(MODEL, truth)
    reach_m = np.linalg.norm(np.ptp(swings, axis=0), axis=-1).max() / np.ptp(truth[:, shoulder])
    assert np.abs(points(MODEL, smoothed(track)) - swings).max() < 0.03 * reach_m
