"""OpenSim moves the exported model by the exported motion to where our joints are."""

import os

import numpy as np
import pytest
from bodies import MODELS
from stored_motions import store_motion

from tracker.formats.model_toml import parse_model
from tracker.geometry import rigid
from tracker.interchange.exports import writers
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion

pytestmark = pytest.mark.slow

ODD_JOINTS = """
version = 1
name = "odd joints"
height_m = 1.5
joints = [
    { name = "root", child = "trunk", free = true, position = [0.1, 0, 0.3], axes = [
        { name = "a", axis = [1, 2, 0] }, { name = "b", axis = [0, 1, 1] }, { name = "c", axis = [1, 0, 3] } ] },
    { name = "zyz", parent = "trunk", child = "arm", position = [0, 0.1, 0.2], axes = [
        { name = "a", axis = [0, 0, 1] }, { name = "b", axis = [0, 1, 0] }, { name = "c", axis = [0, 0, 1] } ] },
    { name = "two", parent = "arm", child = "hand", position = [0, 0, -0.2], axes = [
        { name = "a", axis = [1, 1, 0] }, { name = "b", axis = [0, 1, 0.2] } ] },
]
parts = [
    { name = "trunk", half_axes = [0.1, 0.1, 0.2] },
    { name = "arm", half_axes = [0.03, 0.03, 0.1] },
    { name = "hand", half_axes = [0.02, 0.02, 0.08] },
]
landmarks = [{ name = "finger tip", part = "hand", position = [0.01, 0.02, -0.05] }]
"""
"""Axes that are not orthogonal, axes that repeat, names with spaces."""
BODIES = MODELS | {"odd joints": parse_model(ODD_JOINTS, "odd joints")}


@pytest.fixture(scope="module")
def opensim():
    if os.environ.get("CI") == "true":
        import opensim as found
    else:
        found = pytest.importorskip("opensim", reason="needs the opensim wheel: pip install -e '.[slow]'")
    found.Logger.setLevelString("error")
    return found


@pytest.mark.parametrize("name", sorted(BODIES))
@pytest.mark.parametrize(("axes", "up"), [("y-up", "z"), ("calibration", "-y")])
def test_joints_agree_within_a_tenth_of_a_millimetre(tmp_path, opensim, name, axes, up):
    session, truth = store_motion(tmp_path / "s", [BODIES[name]], gaps={(0, 3)}, up=up, seed=5)
    motion, options = read_motion(session, (0,)), ExportOptions(axes)
    paths = [tmp_path / "a.mot", tmp_path / "a.osim"]
    writers.write_person_opensim(motion, options, paths, lambda: None)
    model = opensim.Model(str(paths[1]))
    state = model.initSystem()
    storage = opensim.Storage(str(paths[0]))
    assert storage.isInDegrees()
    model.getSimbodyEngine().convertDegreesToRadians(storage)
    labels = [storage.getColumnLabels().get(i) for i in range(1, storage.getColumnLabels().getSize())]
    assert storage.getSize() == 7
    T = file_from_world(session, axes)
    up_file = T[:3, :3] @ {"z": [0, 0, 1], "-y": [0, -1, 0]}[up]
    gravity = np.array([model.getGravity()[k] for k in range(3)])
    np.testing.assert_allclose(gravity, -9.80665 * up_file, atol=1e-6)
    for row in range(storage.getSize()):
        vector = storage.getStateVector(row)
        frame = round(vector.getTime() * session.fps)
        for i, label in enumerate(labels):
            model.updCoordinateSet().get(label).setValue(state, vector.getData().get(i), False)
        model.realizePosition(state)
        body = truth[0][frame]
        for point, place in zip(body.model.point_names, body.points_world, strict=True):
            found = model.getMarkerSet().get(point.replace(" ", "_")).getLocationInGround(state)
            error = np.linalg.norm([found[k] for k in range(3)] - rigid.apply(T, place))
            assert error < 1e-4, (frame, point, error)


def test_coordinates_have_the_limits_of_the_joints(tmp_path, opensim):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila34"]], n_frames=2)
    paths = [tmp_path / "a.mot", tmp_path / "a.osim"]
    writers.write_person_opensim(read_motion(session, (0,)), ExportOptions("y-up"), paths, lambda: None)
    model = opensim.Model(str(paths[1]))
    for name, limits in {"left_elbow_extension": (0, 155), "right_hip_flexion": (-45, 140)}.items():
        coordinate = model.getCoordinateSet().get(name)
        degrees = np.degrees([coordinate.getRangeMin(), coordinate.getRangeMax()])
        np.testing.assert_allclose(degrees, limits, atol=1e-6)
        assert not coordinate.getDefaultClamped()


def test_opensim_reads_a_motion_with_a_note_on_the_calibration(tmp_path, opensim):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila34"]])
    motion = read_motion(session, (0,), range(1, 8))
    writers.write_person_opensim(motion, ExportOptions("y-up"), [tmp_path / "a.mot", tmp_path / "a.osim"], lambda: None)
    assert opensim.TimeSeriesTable(str(tmp_path / "a.mot")).getNumRows() == 7
    assert opensim.Storage(str(tmp_path / "a.mot")).getSize() == 7


def test_opensim_reads_a_trc_file_with_gaps(tmp_path, opensim):
    session, truth = store_motion(tmp_path / "s", [MODELS["gavrila34"]], gaps={(0, 3), (0, 7)})
    motion = read_motion(session, (0,), range(1, 8))
    writers.write_person_trc(motion, ExportOptions("y-up", "mm"), [tmp_path / "a.trc"], lambda: None)
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "a.trc"))
    assert table.getNumRows() == 7
    assert table.getTableMetaDataString("Units") == "mm"
    T = file_from_world(session, "y-up")
    for row, frame in enumerate(range(1, 8)):
        assert table.getIndependentColumn()[row] == pytest.approx(frame / session.fps)
        found = table.getRowAtIndex(row)
        for i, point in enumerate(table.getColumnLabels()):
            place = np.array([found[i][k] for k in range(3)])
            if frame in (3, 7):
                assert np.isnan(place).all()
            else:
                at = truth[0][frame].model.point_names.index(point)
                expected = 1000 * rigid.apply(T, truth[0][frame].points_world[at])
                np.testing.assert_allclose(place, expected, atol=0.1)
