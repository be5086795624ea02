"""Rigs from simulated corners: lenses, links of cameras, the adjustment and its expected error."""

from dataclasses import replace

import numpy as np
import pytest
from board_rigs import (
    BOARDS,
    board_poses,
    calibrated,
    filmed,
    in_first_camera,
    rms_error_m,
    simulated_rig,
    true_cameras,
)

from tracker.calibration.boards import pose_choice
from tracker.calibration.boards.board_calibration import MIN_LENS_VIEWS, calibrate_rig
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.camera_graph import link_cameras
from tracker.calibration.boards.expected_error import expected_error
from tracker.calibration.boards.rig_fit import blank_camera, fit_lens, held_out_errors
from tracker.calibration.boards.view_choice import choose_frames, choose_views, outlines, posed_views
from tracker.calibration.check.rig_adjustment import column_ends
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.camera_derivatives import FOCAL, POSE, moved_camera


@pytest.fixture(scope="module")
def rig():
    return simulated_rig(15, 3, gross=0)


@pytest.fixture(scope="module")
def found(rig):
    return calibrated(rig)


@pytest.mark.slow
def test_a_rig_is_calibrated(rig, found):
    true = rms_error_m(in_first_camera(rig.cameras), found.rig.cameras, found.rig.points_world)
    assert true < 0.003
    volume = found.rig.volume
    assert volume.low_m < volume.expected_m < volume.high_m
    assert 0.3 * volume.low_m < true < 3 * volume.high_m
    np.testing.assert_allclose(found.rig.fit.sigmas_px, rig.sigmas_px, rtol=0.25)
    for camera, expected, sigma in zip(found.rig.cameras, rig.cameras, found.rig.fit.focal_sigmas, strict=True):
        assert abs(np.log(camera.K[0, 0] / expected.K[0, 0])) < 4 * sigma + 0.001


@pytest.mark.slow
def test_held_out_frames_took_no_part(rig, found):
    assert len(found.held_out.frames) >= 8
    assert set(found.held_out_corners.frames) <= set(found.held_out.frames)
    # The median is not moved by the gross errors. Of a Gaussian error in the plane it is 1.18 standard deviations.
    for i, sigma in enumerate(rig.sigmas_px):
        off = found.held_out.px[found.held_out.cameras == i]
        assert np.median(off) == pytest.approx(1.18 * sigma, rel=0.35)


@pytest.mark.slow
def test_errors_of_wrong_cameras_are_seen_on_held_out_frames(rig, found):
    """A camera that was turned fits no longer, though the pose of the board is fitted to it."""
    cameras = list(found.rig.cameras)
    step = np.zeros(15)
    step[POSE] = [0, 0.01, 0, 0, 0, 0]
    seen = rig.seen.in_frames(found.held_out.frames)
    poses = pose_choice.board_poses(rig.board, seen, *(replace(c, T_world_camera=np.eye(4)) for c in cameras))
    sigmas = found.rig.fit.sigmas_px
    right = held_out_errors(rig.board, seen, cameras, poses, sigmas)[1]
    wrong = held_out_errors(rig.board, seen, [moved_camera(cameras[0], step), *cameras[1:]], poses, sigmas)[1]
    # On most frames a single camera sees the board, and its pose takes the turn.
    worst = [np.quantile(np.linalg.norm(errors, axis=1), 0.9) for errors in (right, wrong)]
    assert worst[1] > 1.5 * worst[0]


@pytest.mark.parametrize(
    ("focal", "distortion", "fisheye"),
    [
        pytest.param(0.7, (-0.34, 0.1, 0.001, 0.002, -0.004), False, marks=pytest.mark.slow),
        pytest.param(1.5, (0.1, -0.05, 0.0, 0.0, 0.0), False, marks=pytest.mark.slow),
        (0.4, (0.02, -0.01, 0.002, 0.0), True),
    ],
)
def test_a_lens_is_found_from_its_views(focal, distortion, fisheye):
    random = np.random.default_rng(1)
    true = replace(
        blank_camera("cam", (1280, 720), focal, fisheye),
        distortion=np.array(distortion),
        T_world_camera=true_cameras(random, 1)[0].T_world_camera,
    )
    board = BOARDS[2]
    near = board_poses(random, 80, spread=(1.2, 1.2, 0.8))
    seen = filmed(random, board, [true], near, [0.2])
    frames = choose_views(
        {k: o for (_, k), o in outlines(board, seen, posed_views(board, seen), [true.size]).items()}, 40
    )
    found = fit_lens(board, seen, blank_camera("cam", true.size, fisheye=fisheye), frames)
    assert found.camera.K[0, 0] == pytest.approx(true.K[0, 0], rel=4 * found.focal_sigma + 0.001)
    assert found.focal_sigma < 0.02
    # Pixels at which the board was are those of the true lens.
    rays = true.rays(seen.px) @ true.T_world_camera[:3, :3]
    off = found.camera.project(rays) - seen.px
    assert np.median(np.linalg.norm(off - np.median(off, axis=0), axis=1)) < 15
    assert found.sigma_px == pytest.approx(0.2, rel=0.25)


def test_a_camera_without_a_link_is_named():
    rig = simulated_rig(2, 3)
    seen = rig.seen
    apart = seen.where((seen.cameras != 2) | ~np.isin(seen.frames, seen.frames[seen.cameras < 2]))
    flat = [replace(c, T_world_camera=np.eye(4)) for c in rig.cameras]
    with pytest.raises(CalibrationError) as caught:
        link_cameras(rig.board, apart, flat)
    assert "found fewer with camera 'cam2'; film the board where 'cam2' and 'cam0' or 'cam1' see it together" in str(
        caught.value
    )


def test_cameras_are_linked_through_others():
    """Cameras 0 and 2 share no board; camera 1 leads from one to the other."""
    rig = simulated_rig(5, 3, n_frames=100)
    seen = rig.seen
    even = seen.where(((seen.frames % 2 == 0) & (seen.cameras < 2)) | ((seen.frames % 2 == 1) & (seen.cameras > 0)))
    lenses = [replace(c, T_world_camera=np.eye(4)) for c in rig.cameras]
    Ts, _ = link_cameras(rig.board, even, lenses)
    for T, camera in zip(Ts, in_first_camera(rig.cameras), strict=True):
        assert np.linalg.norm(T[:3, 3] - camera.center_world) < 0.2
        assert np.degrees(np.linalg.norm(rigid.so3_log(T[:3, :3].T @ camera.T_world_camera[:3, :3]))) < 4


def test_too_few_views_of_a_camera_are_refused():
    rig = simulated_rig(15, 3, n_frames=25)
    seen = rig.seen
    few = seen.where((seen.cameras != 1) | np.isin(seen.frames, np.unique(seen.frames[seen.cameras == 1])[:3]))
    with pytest.raises(
        CalibrationError, match=f"at least {MIN_LENS_VIEWS} views of camera 'cam1' .* film the board in front of it"
    ):
        calibrated(rig._replace(seen=few))


def at_one_distance(tilt):
    """A board that faces one camera at nearly one distance, so that focal length and distance are alike."""
    random = np.random.default_rng(4)
    cameras = true_cameras(random, 2)
    cameras[1] = replace(
        cameras[1], T_world_camera=cameras[0].T_world_camera @ rigid.transform(None, np.array([0.3, 0, 0]))
    )
    T = cameras[0].T_world_camera
    Ts = []
    for _ in range(15):
        x, y = random.uniform(-0.4, 0.4, 2)
        turn = rigid.so3_exp(np.array([0.0, 0.0, random.uniform(0, 6)])) @ rigid.so3_exp(tilt * random.normal(size=3))
        Ts.append(T @ rigid.transform(turn, np.array([x, y, 2.0 + random.uniform(-0.15, 0.15)])))
    board = BOARDS[2]
    seen = filmed(random, board, cameras, np.stack(Ts), [0.3, 0.3], gross=0)
    return board, seen, ["a", "b"], [c.size for c in cameras], [False, False]


@pytest.mark.slow
def test_a_board_at_one_distance_tells_no_focal_length():
    found = calibrate_rig(*at_one_distance(0.08))
    assert len(found.notes) == 2
    assert "does not tell its focal length better than to" in found.notes[0]
    assert "film the board nearer, farther and tilted" in found.notes[0]


@pytest.mark.slow
def test_a_focal_length_that_is_as_good_as_unknown_is_refused():
    with pytest.raises(CalibrationError, match=r"focal length of camera 'a' to 10% at least, found .* of 20%"):
        calibrate_rig(*at_one_distance(0.01))


def still_rig(turn=0.0, slide=0.0):
    """A board in front of two cameras that stands, or is moved and turned in its plane."""
    random = np.random.default_rng(3)
    cameras = true_cameras(random, 2)
    T = cameras[0].T_world_camera
    cameras[1] = replace(cameras[1], T_world_camera=T @ rigid.transform(None, np.array([0.3, 0, 0])))
    tilted = T @ rigid.transform(rigid.so3_exp(np.array([0.3, 0.4, 0.0])), np.array([0.0, 0.0, 2.0]))
    Ts = [
        tilted @ rigid.transform(rigid.so3_exp(np.array([0, 0, turn * k])), slide * np.append(random.normal(size=2), 0))
        for k in range(8)
    ]
    seen = filmed(random, BOARDS[1], cameras, np.stack(Ts), [0.3, 0.3], gross=0, covered=0)
    return BOARDS[1], seen, ["a", "b"], [c.size for c in cameras], [False, False]


@pytest.mark.parametrize(("turn", "slide"), [(0.0, 0.0), pytest.param(0.5, 0.1, marks=pytest.mark.slow)])
def test_a_board_that_stands_or_stays_in_its_plane_is_refused(turn, slide):
    with pytest.raises(CalibrationError, match=r"found all its corners within .* cm of one plane, of a board 35 cm"):
        calibrate_rig(*still_rig(turn, slide))


@pytest.mark.slow
def test_cameras_of_a_tiny_board_are_those_of_a_large_one(rig, found):
    """A board of another unit is calibrated as one of a usual size, without numbers that vanish."""
    tiny = calibrated(rig._replace(board=replace(rig.board, square_m=rig.board.square_m / 1000)))
    for small, large in zip(tiny.rig.cameras, found.rig.cameras, strict=True):
        np.testing.assert_allclose(1000 * small.center_world, large.center_world, atol=1e-3)
        np.testing.assert_allclose(small.K, large.K, rtol=1e-3)
    assert 1000 * tiny.rig.volume.expected_m == pytest.approx(found.rig.volume.expected_m, rel=0.05)
    assert "check the unit of its squares" in tiny.notes[0]
    assert not any("squares" in note for note in found.notes)


@pytest.mark.slow
def test_one_video_under_two_names_is_refused(rig):
    cameras = [rig.cameras[0], rig.cameras[0], rig.cameras[1]]
    parts = [rig.seen.of_camera(i) for i in (0, 0, 1)]
    seen = SeenCorners(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    seen = seen._replace(cameras=np.repeat(np.arange(3), [len(part.px) for part in parts]))
    with pytest.raises(CalibrationError, match=r"found 'a' and 'b' .* cm apart, as of one video under two names"):
        calibrate_rig(rig.board, seen, ["a", "b", "c"], [c.size for c in cameras], [False] * 3)


@pytest.mark.parametrize("bad", [np.inf, *(pytest.param(v, marks=pytest.mark.slow) for v in (np.nan, 1e200))])
def test_corners_that_are_no_numbers_are_refused(bad):
    board, seen, *others = still_rig()
    px = seen.px.copy()
    px[::3] = bad
    with pytest.raises(CalibrationError):
        calibrate_rig(board, seen._replace(px=px), *others)


@pytest.mark.slow
def test_the_expected_error_is_that_of_drawn_cameras(rig):
    """Cameras drawn from a covariance have errors with the quantiles that were expected."""
    random = np.random.default_rng(0)
    cameras = in_first_camera(rig.cameras)
    ends = column_ends(cameras)
    sigmas = np.zeros(ends[-1])
    for start in ends[:-1]:
        sigmas[start : start + 6] = [2e-4] * 3 + [5e-4] * 3
        sigmas[start + FOCAL] = 1e-4
    world = rigid.inverse(rig.cameras[0].T_world_camera)
    points = rigid.apply(world, np.array([0.0, 0.0, 1.0]) + random.uniform(-0.4, 0.4, (60, 3)))
    error = expected_error(cameras, np.diag(sigmas**2), points)
    errors = []
    for _ in range(60):
        step = sigmas * random.normal(size=ends[-1])
        drawn = [moved_camera(c, step[a:b]) for c, a, b in zip(cameras, ends, ends[1:], strict=False)]
        errors.append(rms_error_m(cameras, drawn, points))
    assert np.median(errors) == pytest.approx(error.expected_m, rel=0.15)
    inside = np.mean((np.array(errors) > error.low_m) & (np.array(errors) < error.high_m))
    assert 0.8 <= inside <= 0.98


def test_moving_the_whole_rig_is_no_error(rig):
    """The covariance of one rigid motion of all cameras, whatever its size, moves no point after the fit."""
    cameras = in_first_camera(rig.cameras)
    ends = column_ends(cameras)
    moves = np.zeros((ends[-1], 6))
    for camera, start in zip(cameras, ends, strict=False):
        R, C = camera.T_camera_world[:3, :3], camera.center_world
        # The world turns by w and moves by t: R' = R exp(-[w]), C' = C + w x C + t.
        moves[start : start + 3, :3], moves[start + 3 : start + 6, 3:] = -R, R
        moves[start + 3 : start + 6, :3] = -R @ rigid.skew(C)
    world = rigid.inverse(rig.cameras[0].T_world_camera)
    points = rigid.apply(world, np.array([0.0, 0.0, 1.0]) + np.random.default_rng(1).uniform(-0.4, 0.4, (40, 3)))
    error = expected_error(cameras, moves @ moves.T, points)
    assert error.high_m < 1e-6


def test_chosen_frames_are_bounded_and_diverse():
    random = np.random.default_rng(0)
    alike, apart = 0.001 * random.normal(size=(50, 8)), random.normal(size=(10, 8))
    of_one = dict(enumerate(np.concatenate([alike, apart])))
    chosen = choose_views(of_one, 12)
    assert len(chosen) == 12
    assert set(range(50, 60)) <= set(chosen.tolist())
    both = {(c, k): o for k, o in of_one.items() for c in range(2)}
    assert len(choose_frames(both, 2, most=20)) == 20
    assert len(choose_frames({}, 2)) == 0


@pytest.mark.slow
def test_intervals_hold_the_true_error():
    """Of 30 rigs, 90% intervals hold 27 on average, and fewer than 23 in 1 of 50 cases."""
    inside = []
    seed = 0
    while len(inside) < 30:
        seed += 1
        rig = simulated_rig(500 + seed)
        try:
            found = calibrated(rig).rig
        except CalibrationError:
            continue
        true = rms_error_m(in_first_camera(rig.cameras), found.cameras, found.points_world)
        inside.append(found.volume.low_m <= true <= found.volume.high_m)
    assert sum(inside) >= 23
