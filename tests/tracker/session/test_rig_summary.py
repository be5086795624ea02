"""Numbers by which a user sees whether the cameras of a calibration stand as in the studio."""

import numpy as np
import pytest
from rigs import cameras, looking, on_circle, ring

from tracker.geometry import rigid
from tracker.geometry.camera_rig import axes_point
from tracker.session.rig_summary import summarize_rig


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
