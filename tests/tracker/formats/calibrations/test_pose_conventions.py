"""Wrong conventions of poses on random rigs: refused, or noted where nothing can be told; right ones are read."""

from collections import Counter

import numpy as np
import pytest
from rigs import looking, on_circle, random_rig
from stated_poses import CONVENTIONS, stated

from tracker.errors import CalibrationError
from tracker.formats.calibrations.pose_conventions import STATED, check_convention, costs, read_pose
from tracker.geometry import rigid

EXPECTED = "poses that map world to camera"
KINDS = ("ring", "arc", "corners", "row", "pair", "turned by 90 degrees")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_random_rigs(kind):
    rng, counts = np.random.default_rng(5), Counter()
    for _ in range(25):
        rig = [rigid.inverse(T) for T in random_rig(rng, kind)]
        for convention in CONVENTIONS:
            poses = [stated(T, convention) for T in rig]
            is_right = "right" if convention == STATED else "wrong"
            try:
                note = check_convention(poses, "file", EXPECTED, False)
                counts[is_right, "silent" if note is None else "noted"] += 1
            except CalibrationError as error:
                named = error.remedy.fields.get("poses") == convention or f"{convention} (" in str(error)
                counts[is_right, "named" if named else "misnamed"] += 1
    assert counts["right", "named"] == counts["right", "misnamed"] == 0
    assert counts["wrong", "silent"] == 0
    assert counts["wrong", "named"] > (0.6 if kind == "pair" else 0.75) * 25 * 7
    assert counts["wrong", "misnamed"] < 0.02 * 25 * 7


@pytest.mark.parametrize("n", [2, 3, 5])
def test_of_parallel_cameras_nothing_can_be_told(n):
    rig = [rigid.inverse(looking([x, 0, 1.0], [x, 4.0, 1.0])) for x in np.linspace(-1, 1, n)]
    for convention in ("world-to-camera", "camera-to-world", "row-vectors", "camera-position"):
        assert check_convention([stated(T, convention) for T in rig], "file", EXPECTED, True) is None


def test_cameras_that_look_outwards_are_asked_about():
    outward = [rigid.inverse(looking(on_circle(a, 0.4), on_circle(a, 4.0))) for a in (0.0, 1.5, 3.0, 4.5)]
    with pytest.raises(CalibrationError, match="axes of OpenGL"):
        check_convention(outward, "file", EXPECTED, True)


def test_one_camera_has_no_convention():
    assert check_convention([np.eye(4)], "file", EXPECTED, False) is None


def test_the_cost_is_free_of_world_and_scale():
    rng = np.random.default_rng(1)
    rig = random_rig(rng, "ring")
    turned = rigid.transform(rigid.so3_exp(rng.normal(size=3)), rng.normal(size=3))
    cost = costs([rigid.inverse(T) for T in rig])["world-to-camera"]
    moved = [turned @ T for T in rig]
    for T in moved:
        T[:3, 3] *= 1000
    assert costs([rigid.inverse(T) for T in moved])["world-to-camera"] == pytest.approx(cost, abs=1e-6)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_each_convention_is_read(convention):
    T = rigid.inverse(looking([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(read_pose(stated(T, convention), convention), T, atol=1e-12)


def test_hundreds_of_cameras_are_compared_in_part():
    rig = [rigid.inverse(looking(on_circle(a))) for a in np.linspace(0, 6, 525)]
    with pytest.raises(CalibrationError, match="X_world = R X_camera"):
        check_convention([stated(T, "camera-to-world") for T in rig], "file", EXPECTED, True)


UNUSUAL = {
    "under the ceiling": lambda rng, n: [looking(np.array([x, y, 4.0]) + rng.normal(size=3) / 5, [x / 2, y / 2, 0.0],
    rng.choice(4) * np.pi / 2) for x in (-2, 0.1, 2) for y in (-1.5, 1.5)], "aimed at parts of a hall": lambda rng, n:
    [looking(on_circle(2 * np.pi * i / n, 5, 2.5), np.array([0, 0, 1]) + rng.normal(size=3) * [2, 2, 0.3]) for i in
    range(n)], "along a walkway": lambda rng, n: [looking([x, -2 * side, 2.0], [x + rng.normal() / 2, 2 * side, 1.0])
    for x in np.linspace(-6, 6, n) for side in (1, -1)], "far and narrow": lambda rng, n: [looking(on_circle(a, 15, 3))
    for a in np.linspace(0, 0.5, n)], "low and high": lambda rng, n: [looking(on_circle(2 * np.pi * i / n, 4,
    rng.choice([0.3, 3.5])), [0, 0, 1 + rng.normal() / 3]) for i in range(n)], "stereo pairs": lambda rng, n:
    [looking(on_circle(2 * np.pi * i / n + d), [0, 0, 1 + rng.normal() / 5]) for i in range(n) for d in (0, 0.03)]
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", UNUSUAL)
def test_right_poses_of_unusual_rigs_are_read(name):
    rng, refused = np.random.default_rng(9), 0
    for _ in range(25):
        rig = UNUSUAL[name](rng, int(rng.integers(3, 9)))
        world = rigid.transform(rigid.so3_exp(2 * rng.normal(size=3)), rng.normal(size=3))
        try:
            check_convention([rigid.inverse(world @ T) for T in rig], "file", EXPECTED, True)
        except CalibrationError:
            refused += 1
    # A walkway has no one point: of 80, one was refused in the measurement.
    assert refused <= (1 if name == "along a walkway" else 0)
