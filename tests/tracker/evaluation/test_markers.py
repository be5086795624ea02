"""Joint centres from markers: published regressions, simulated markers on simulated skins, lag and axes."""

from dataclasses import replace

import numpy as np
import pytest
from true_poses import sample_with_poses

from app.main import main
from tracker.body.model import PosedBody
from tracker.errors import FormatError
from tracker.evaluation.markers.agreement import compare_with_markers
from tracker.evaluation.markers.marker_set import known_sets, read_marker_set
from tracker.evaluation.markers.reference import joint_centres, read_centres, read_marker_reference
from tracker.evaluation.references import stored_motion
from tracker.formats.model_toml import load_model
from tracker.formats.trc import MarkerTable, write_trc
from tracker.geometry import rigid
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.outfit import BLACK_AND_WHITE
from tracker.simulate.people.skin import make_skin, rest_values

RATE = 100.0
SIDES = ("left", "right")
ENDS = {
    "knee": ("lateral_epicondyle", "medial_epicondyle"),
    "ankle": ("lateral_malleolus", "medial_malleolus"),
    "elbow": ("lateral_elbow", "medial_elbow"),
    "wrist": ("radial_wrist", "ulnar_wrist"),
}
"""The landmarks across each joint."""


@pytest.mark.parametrize(
    ("hips", "right"),
    [
        ("harrington", (-0.24 * 160 - 9.9, 0.33 * 240 + 7.3, -0.30 * 240 - 10.9)),
        ("bell", (-0.19 * 240, 0.36 * 240, -0.30 * 240)),
    ],
)
def test_hips_lie_where_the_regressions_put_them(hips, right):
    """A pelvis of 240 mm by 160 mm whose front looks along x, in a world in which z points up and y to the left."""
    pelvis = {
        "left_asis": (0, 0.12, 1),
        "right_asis": (0, -0.12, 1),
        "left_psis": (-0.16, 0.05, 1),
        "right_psis": (-0.16, -0.05, 1),
    }
    R = rigid.so3_exp(np.array([0.3, -0.2, 0.5]))
    found = joint_centres({name: np.array([p]) @ R.T for name, p in pelvis.items()}, hips)
    forward, lateral, up = np.array(right) / 1000
    np.testing.assert_allclose(found["right_hip"][0] @ R, (forward, -lateral, 1 + up), atol=1e-9)
    np.testing.assert_allclose(found["left_hip"][0] @ R, (forward, lateral, 1 + up), atol=1e-9)


def test_each_set_of_the_field_names_landmarks_of_all_joints():
    for name in known_sets():
        names = read_marker_set(name)
        assert all(
            names.names(f"{side}_{of}") for side in SIDES for of in ("asis", "lateral_epicondyle", "medial_malleolus")
        )
    with pytest.raises(FormatError, match="expected a marker set among cast, helen-hayes, plug-in-gait"):
        read_marker_set("gait")


def markers_on_skin(skin):
    """Vertices beside each joint, by the first name of its landmark in Plug-in Gait, and the joint's own index."""
    names, model = read_marker_set("plug-in-gait"), skin.model
    body = PosedBody(model, rest_values(model))
    centres = dict(zip(model.point_names, body.joint_centers_world, strict=True))
    found = {}
    for side in SIDES:
        for joint, ends in ENDS.items():
            below = {"knee": "ankle", "elbow": "wrist"}.get(joint)
            above = {"ankle": "knee", "wrist": "elbow"}.get(joint)
            other = centres[f"{side}_{below or above}"]
            along = other - centres[f"{side}_{joint}"]
            along /= np.linalg.norm(along)
            across = np.cross(along, (1.0, 0.0, 0.0) if abs(along[0]) < 0.9 else (0.0, 1.0, 0.0))
            across /= np.linalg.norm(across)
            for landmark, sign in zip(ends, (1.0, -1.0), strict=True):
                ray = skin.vertices_rest - centres[f"{side}_{joint}"]
                depth = ray @ (sign * across)
                beside = np.linalg.norm(ray - np.outer(depth, sign * across), axis=1)
                near = np.where((depth > 0) & (depth < 0.12), beside, np.inf)
                found[names.names(f"{side}_{landmark}")[0]] = int(near.argmin())
    return found


@pytest.mark.slow
def test_midpoints_of_simulated_markers_lie_within_5_mm_of_the_joints(tmp_path):
    (role,) = cast_of("walk_in_place")
    model = load_model("gavrila38", role.height_m)
    skin = make_skin(model, BLACK_AND_WHITE)
    marks = markers_on_skin(skin)
    poses = solve_posture(role, model, 25, 25.0)
    points = np.stack([skin.posed(pose)[list(marks.values())] for pose in poses])
    points += np.random.default_rng(0).normal(scale=0.0005, size=points.shape)
    write_trc(tmp_path / "a.trc", tuple(marks), points, 25.0)
    table = read_centres(tmp_path / "a.trc", "plug-in-gait")
    assert set(table.names) == {f"{side}_{joint}" for side in SIDES for joint in ("knee", "ankle", "elbow", "wrist")}
    true = np.stack([PosedBody(model, pose).joint_centers_world for pose in poses])
    for i, name in enumerate(table.names):
        errors = np.linalg.norm(table.points[:, i] - true[:, model.point_names.index(name)], axis=1)
        assert np.median(errors) < 0.005, name


@pytest.fixture
def walk(tmp_path):
    """The stored motion of the sample."""
    session = sample_with_poses(tmp_path / "s", 50)
    return stored_motion(session, 0).joints


def as_markers(path, joints, T):
    """Write each joint as two markers beside it, at 100 Hz, in other axes and on another clock; return its start, s."""
    names, marks, rng = read_marker_set("plug-in-gait"), {}, np.random.default_rng(1)
    times = joints.frames / joints.rate
    at = np.arange(times[0] - 0.3, times[-1] + 0.3, 1 / RATE)
    for side in SIDES:
        for joint, ends in ENDS.items():
            own = joints.points[:, joints.names.index(f"{side}_{joint}")]
            curve = np.stack([np.interp(at, times, own[:, axis]) for axis in range(3)], axis=1)
            apart = 0.05 * np.array([0.6, 0.0, 0.8])
            for end, sign in zip(ends, (1, -1), strict=True):
                marks[names.names(f"{side}_{end}")[0]] = (
                    curve + sign * apart + rng.normal(scale=0.001, size=curve.shape)
                )
    points = rigid.apply(rigid.inverse(T), np.stack(list(marks.values()), axis=1))
    points[40:60, 0] = np.nan
    write_trc(path, tuple(f"walker:{name}" for name in marks), points, RATE, units="mm")
    return at[0]


def test_lag_and_axes_are_found_by_the_motion(tmp_path, walk):
    T = rigid.transform(rigid.so3_exp(np.array([1.2, 0.4, -2.0])), np.array([3.0, -1.0, 0.5]))
    began = as_markers(tmp_path / "a.trc", walk, T)
    found = read_marker_reference(tmp_path / "a.trc", "plug-in-gait", walk)
    assert abs(found.lag_s + began) < 0.25 / walk.rate
    turn = rigid.so3_log(found.T_world_markers[:3, :3] @ T[:3, :3].T)
    assert np.degrees(np.linalg.norm(turn)) < 0.5
    table = found.reference.joints
    errors = np.linalg.norm(table.points - walk.points[:, [walk.names.index(n) for n in table.names]], axis=-1)
    assert np.nanmedian(errors) < 0.003
    _, agreement = compare_with_markers(walk, table, "walker", range(50))
    assert set(agreement.joints) == set(table.names)


def test_a_motion_that_does_not_show_the_lag_is_refused(tmp_path, walk):
    still = replace(walk, points=np.broadcast_to(walk.points[:1], walk.points.shape).copy())
    as_markers(tmp_path / "a.trc", still, np.eye(4))
    with pytest.raises(FormatError, match="expected a motion that shows by how much the clocks"):
        read_marker_reference(tmp_path / "a.trc", "plug-in-gait", still)


def test_a_file_without_the_markers_of_the_set_says_which_it_lacks(tmp_path):
    write_trc(tmp_path / "a.trc", ("LASI", "RASI"), np.zeros((5, 2, 3)), RATE)
    with pytest.raises(FormatError, match="for three joints or more, found those for 0; it lacks SACR"):
        read_centres(tmp_path / "a.trc", "plug-in-gait")


@pytest.mark.slow
def test_the_command_reports_agreement_and_writes_its_pictures(tmp_path, walk, capsys, monkeypatch):
    as_markers(tmp_path / "a.trc", walk, np.eye(4))
    words = ["evaluate", tmp_path / "s", "--reference", tmp_path / "a.trc", "--marker-set", "plug-in-gait"]
    monkeypatch.setattr("sys.argv", ["quadrille", *map(str, words), "--report", str(tmp_path / "r.html")])
    main()
    assert "the markers lie at" in capsys.readouterr().out
    assert (tmp_path / "r.html").read_text("utf-8").count("<svg") == 8


def test_angles_are_those_between_the_bones():
    points = np.array([[(0, 0, 1.0), (0, 0, 0.5), (0.25, 0, 0.5 - 0.25 * np.sqrt(3))]])
    names = ("left_hip", "left_knee", "left_ankle")
    one = MarkerTable(names, np.arange(1), np.zeros(1), points, 25.0)
    straight = replace(one, points=np.array([[(0, 0, 1.0), (0, 0, 0.5), (0, 0, 0.0)]]))
    _, agreement = compare_with_markers(one, straight, "a", [0])
    assert np.degrees(agreement.angles["left_knee"].limits.bias) == pytest.approx(30)


def gait(n, rate, seed=0, cycle_s=1.0):
    """Four pairs of joints that swing, ever differently, at a rate."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    names = tuple(f"{side}_{joint}" for side in SIDES for joint in ENDS)
    knots = np.arange(int(t[-1]) + 2)
    drift = np.interp(t, knots, rng.normal(size=len(knots)).cumsum())
    points = np.zeros((n, len(names), 3))
    for i in range(len(names)):
        amplitude, phase = rng.uniform(0.1, 0.3), rng.uniform(0, 2 * np.pi)
        points[:, i] = rng.normal(size=3) + 0.05 * drift[:, None] * rng.normal(size=3)
        points[:, i, 0] += amplitude * np.sin(2 * np.pi * t / cycle_s + phase + 0.2 * drift)
    return MarkerTable(names, np.arange(n), t, points, rate)


@pytest.mark.parametrize(
    "rows",
    [range(250), [*range(60), *range(170, 250)], range(0, 250, 3), [*range(0, 120, 3), *range(120, 250)]],
    ids=["whole", "gap", "stride", "two strides"],
)
def test_the_lag_is_found_where_frames_are_missing(tmp_path, rows):
    motion = gait(250, 25.0)
    began = as_markers(tmp_path / "a.trc", motion, np.eye(4))
    some = replace(motion, frames=motion.frames[rows], times=motion.times[rows], points=motion.points[rows])
    found = read_marker_reference(tmp_path / "a.trc", "plug-in-gait", some)
    assert abs(found.lag_s + began) < 0.25 / motion.rate


def test_a_motion_that_repeats_is_refused(tmp_path):
    t = np.arange(250) / 25.0
    motion = gait(250, 25.0)
    again = replace(motion, points=motion.points[(np.arange(250) % 25)])
    as_markers(tmp_path / "a.trc", again, np.eye(4))
    part = replace(again, frames=again.frames[:150], times=t[:150], points=again.points[:150])
    with pytest.raises(FormatError, match="alike at several lags"):
        read_marker_reference(tmp_path / "a.trc", "plug-in-gait", part)
