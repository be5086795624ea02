"""Numbers by which a user sees whether the cameras of a calibration stand as in the studio."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import cameras, looking, on_circle, ring

from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.camera_rig import axes_point
from tracker.session.rig_summary import check_shared_view, summarize_rig


def test_distances_and_heights():
    summary = summarize_rig(cameras([looking([3.0, 0, 1.0]), looking([0, 4.0, 2.0]), looking([-5.0, 0, 1.0])]))
    np.testing.assert_allclose(summary.viewed_point_world, [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(summary.distances_m, [3, np.hypot(4, 1), 5])
    np.testing.assert_allclose(summary.heights_m, [1, 2, 1])
    assert "stand 3.00 to 5.00 m from the point" in summary.sentence
    assert summary.doubts == ()


def test_parallel_cameras_look_at_no_point():
    summary = summarize_rig(cameras([looking([x, 0, 1.0], [x, 4.0, 1.0]) for x in (-1.0, 0.0, 1.0)]))
    assert summary.viewed_point_world is summary.distances_m is None
    assert "no common point" in summary.sentence


@pytest.mark.parametrize("turn", [np.zeros(3), np.array([np.pi / 2, 0, 0]), np.array([0, np.pi, 0])])
def test_the_up_axis_is_that_of_the_pictures(turn):
    world = rigid.transform(rigid.so3_exp(turn))
    rig = cameras([world @ T for T in ring(4)])
    right = [up for up in ("x", "y", "z", "-x", "-y", "-z") if not summarize_rig(rig, up).doubts]
    axis = np.round(world[:3, 2]).astype(int)
    name = ("-" if axis.sum() < 0 else "") + "xyz"[int(np.flatnonzero(axis)[0])]
    assert right == [name]
    wrong = "y" if name == "z" else "z"
    assert any(f"along {name}, not {wrong}" in doubt for doubt in summarize_rig(rig, wrong).doubts)


def test_rolled_cameras_leave_the_up_axis_open():
    rig = cameras([looking(on_circle(a), roll=np.pi / 2) for a in (0.0, 1.0, 2.0)])
    assert not summarize_rig(rig).doubts


def test_cameras_under_the_floor():
    shift = rigid.transform(t=np.array([0, 0, -2.0]))
    (doubt,) = summarize_rig(cameras([shift @ T for T in ring(3)])).doubts
    assert "Under the floor" in doubt
    assert "cam0, cam1, cam2" in doubt
    at_camera = rigid.inverse(ring(3)[0])
    assert not any("floor" in doubt for doubt in summarize_rig(cameras([at_camera @ T for T in ring(3)]), "-y").doubts)


def test_a_person_of_few_pixels_lets_the_unit_be_doubted():
    (doubt,) = summarize_rig(cameras(ring(4, radius=68.0, height=20.0))).doubts
    assert "check the unit" in doubt
    assert not summarize_rig(cameras(ring(4, radius=15.0, height=4.0))).doubts


def test_point_of_the_axes_is_free_of_scale():
    a, b = axes_point(ring(3)), axes_point(ring(3, 4000, 1500, target=[0, 0, 1000]))
    np.testing.assert_allclose(a.position * 1000, b.position, atol=1e-6)


def test_copied_poses_are_noted():
    rig = ring(4)
    rig[2] = rig[0]
    (doubt,) = summarize_rig(cameras(rig)).doubts
    assert "Cameras 'cam0' and 'cam2' stand 0 cm apart" in doubt
    near = [looking([x, 4.0, 1.5]) for x in (0.0, 0.065)]
    assert summarize_rig(cameras(near)).doubts == ()  # a stereo camera


@pytest.mark.parametrize("place", [(1.5, -2.5), (959.5, 539.5), (0.5, 0.5)])
def test_a_principal_point_far_from_the_middle_is_noted(place):
    rig = cameras(ring(3))
    K = rig[1].K.copy()
    K[:2, 2] = place
    (doubt,) = summarize_rig([rig[0], replace(rig[1], K=K), rig[2]]).doubts
    assert "principal point lies far from the middle of the pictures of 'cam1':" in doubt


def test_distortion_in_another_order_is_noted():
    rig = cameras(ring(3), (-0.3, 0.1, -0.2, 0.001, 0.0005))
    (doubt,) = summarize_rig(rig).doubts
    assert "tangential distortion of 'cam0', 'cam1', 'cam2' is up to 0.2, that of no usual lens" in doubt
    assert summarize_rig(cameras(ring(3), (-0.3, 0.1, 0.002, 0.001, -0.2))).doubts == ()
    fisheyes = [replace(c, distortion=np.array([0.1, 0.1, -0.2, 0.1]), fisheye=True) for c in rig]
    assert summarize_rig(fisheyes).doubts == ()


BACK_TO_BACK = [looking([x, 0, 1.0], [4 * x, 0, 1.0]) for x in (-1.0, 1.0)]


@pytest.mark.parametrize(
    "Ts",
    [
        ring(4),
        [looking([x, 0, 1.0], [x, 4.0, 1.0]) for x in (-0.03, 0.03)],
        [looking([3.0 * k, 0, 2.0], [3.0 * k, 4.0, 1.0]) for k in range(6)],
        [looking([6.0 * k, 0, 2.5], [6.0 * k + 4.0, 0.1, 1.0]) for k in range(5)],
        [*BACK_TO_BACK, looking([0, 3.0, 1.0], [1.0, 3.0, 1.0])],
        [looking([0, 0, 1.0], [4.0, 0, 1.0]), looking([8.0, 0, 1.0], [4.0, 0, 1.0])],
    ],
    ids=["ring", "stereo", "wall", "corridor", "a pair of three", "face to face"],
)
def test_rigs_of_which_two_cameras_share_a_view_are_taken(Ts):
    check_shared_view(cameras(Ts))


@pytest.mark.parametrize(
    "Ts",
    [
        BACK_TO_BACK,
        [looking([0.1 * np.cos(a), 0.1 * np.sin(a), 1], [np.cos(a), np.sin(a), 1]) for a in np.arange(4) * np.pi / 2],
        [looking([0, 0, 70.0 * k], [4.0, 0, 70.0 * k]) for k in range(3)],
        [rigid.inverse(T) for T in ring(4, height=2.0)],
    ],
    ids=["back to back", "outwards", "rooms apart", "inverted poses"],
)
def test_cameras_without_a_shared_view_are_refused(Ts):
    with pytest.raises(CalibrationError, match="two cameras that can see a person together") as caught:
        check_shared_view(cameras(Ts))
    assert caught.value.remedy.code == "any_size"
