"""The same cameras from the layout of each program, and wrong conventions in each of them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from calibration_files import (
    WRITERS,
    dannce,
    jarvis,
    mc_calib,
    opencv_words,
    openpose,
    parts,
    qualisys,
    rig_for,
    to_json,
)
from program_tables import calibration_table
from rigs import cameras, looking, ring
from stated_poses import CONVENTIONS, stated

from tracker.errors import CalibrationError
from tracker.formats.calibrations.document import read_document
from tracker.formats.calibrations.layouts import find_layout, layouts
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid

LENS = (-0.12, 0.03, 0.001, -0.0005)
RIG = cameras([looking(p) for p in ([4.0, 0.3, 1.5], [0.2, 3.5, 2.0], [-4.0, 0.0, 1.7], [0.0, -4.2, 1.2])], LENS)


NAMES = (["cam0", "cam1"], ["cam_0", "cam_1"], ["camera_0", "camera_1"], ["cam1", "cam2"], ["0", "1"])
"""Names of the first cameras as layouts have them; some have numbers alone, or none."""


def rig_of(name):
    """The cameras that a layout can hold."""
    return rig_for(WRITERS[name], RIG)


def assert_same(entries, rig):
    """Check that cameras project points to the same pixels, in the world of the first one."""
    points = np.random.default_rng(0).uniform((-0.6, -0.6, 0.4), (0.6, 0.6, 1.6), (20, 3))
    first = entries[0].camera(rig[0].size)
    for entry, expected in zip(entries, rig, strict=True):
        camera = entry.camera(expected.size)
        world = first.T_world_camera @ rig[0].T_camera_world
        np.testing.assert_allclose(
            camera.project(rigid.apply(world, points)), expected.project(points), atol=1e-5, err_msg=entry.name
        )
    return first


def test_each_layout_has_a_writer_here():
    assert [layout.name for layout in layouts()] == list(WRITERS)


@pytest.mark.parametrize("name", WRITERS)
def test_each_layout_is_read_as_its_program_means_it(tmp_path, name):
    rig = rig_of(name)
    path = WRITERS[name](tmp_path, rig)
    reading = read_cameras(path)
    first = assert_same(reading.entries, rig)
    if not name.startswith("Kalibr"):  # which knows no world
        np.testing.assert_allclose(first.T_world_camera, rig[0].T_world_camera, atol=1e-9)
    assert reading.left_out == {}
    assert [e.name for e in reading.entries][:2] in NAMES
    assert all(e.size in ((640, 480), None) for e in reading.entries)


@pytest.mark.parametrize("name", WRITERS)
def test_the_name_of_the_file_does_not_matter(tmp_path, name):
    path = WRITERS[name](tmp_path, rig_of(name))
    if path.is_dir():
        path = next(path.iterdir())
    other = path.rename(tmp_path / "calibration.bak")
    layout = find_layout(read_document(other))
    assert layout is not None
    assert layout.name == name


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("name", [n for n in WRITERS if not n.startswith(("Kalibr", "DLT"))])
def test_a_wrong_convention_is_named_in_each_layout(tmp_path, name, convention):
    rig = [replace(c, T_world_camera=rigid.inverse(stated(c.T_camera_world, convention))) for c in rig_of(name)]
    path = WRITERS[name](tmp_path, rig)
    if convention == "world-to-camera":
        assert_same(read_cameras(path).entries, rig_of(name))
        return
    with pytest.raises(CalibrationError, match="see no one place") as caught:
        read_cameras(path)
    remedy = caught.value.remedy
    assert remedy.fields.get("poses", convention) == convention
    assert_same(read_cameras(path, poses=convention).entries, rig_of(name))


def test_qualisys_by_pose2sim_counts_the_lens_in_64ths(tmp_path):
    assert_same(read_cameras(qualisys(tmp_path, RIG, scale=64.0, version="none")).entries, RIG)


def test_a_camera_turned_in_qtm_is_left_out_by_name(tmp_path):
    path = qualisys(tmp_path, RIG)
    path.write_text(path.read_text().replace('viewrotation="0"', 'viewrotation="90"', 1))
    reading = read_cameras(path)
    assert len(reading.entries) == 3
    assert "turned by 90 degrees" in reading.left_out["cam0"]


def test_the_lens_of_vicon_is_refused_by_name(tmp_path):
    path = WRITERS["Vicon (`.xcp`)"](tmp_path, rig_of("Vicon (`.xcp`)"))
    path.write_text(path.read_text().replace(" 0 0 0", " -1e-8 0 0"))
    with pytest.raises(CalibrationError, match="camera 'cam0' has Vicon's lens model"):
        read_cameras(path)


def test_groups_of_mc_calib_share_no_world(tmp_path):
    path = mc_calib(tmp_path, RIG)
    path.write_text(path.read_text().replace("camera_group: 0", "camera_group: 1", 1))
    with pytest.raises(CalibrationError, match=r"one group of cameras, found 2"):
        read_cameras(path)


def test_several_files_and_their_names(tmp_path):
    openpose(tmp_path, [replace(c, name=f"jarvis_{c.name}_2024") for c in RIG])
    files = sorted(tmp_path.glob("*.xml"))
    assert [e.name for e in read_cameras(files).entries] == [f"jarvis_cam{i}_2024" for i in range(4)]
    assert [e.name for e in read_cameras(files, footage={"cam0"}).entries] == [f"cam{i}" for i in range(4)]
    assert [e.name for e in read_cameras(tmp_path, footage={"cam3"}).entries] == [f"cam{i}" for i in range(4)]
    assert [e.name for e in read_cameras(files[0]).entries] == ["jarvis_cam0_2024"]


def test_a_folder_with_two_calibrations_is_refused(tmp_path):
    opencv_words(tmp_path, RIG)
    jarvis(tmp_path, RIG)
    with pytest.raises(CalibrationError, match=r"a folder with calibrations of several layouts, cam0\.yaml"):
        read_cameras(tmp_path)
    with pytest.raises(CalibrationError, match=r"files of one layout, found another one in cameras\.json"):
        read_cameras([tmp_path / "cam0.yaml", tmp_path / "cameras.json"])


def test_row_vectors_under_opencvs_words(tmp_path):
    rows = {
        c.name: {"K": c.K.T, "R": c.T_world_camera[:3, :3], "t": c.T_camera_world[:3, 3], "size": c.size} for c in RIG
    }
    path = to_json(tmp_path / "rows.json", rows)
    with pytest.raises(
        CalibrationError, match=r"principal point in the last row, .*row vectors.*rotations are"
    ) as caught:
        read_cameras(path)
    assert caught.value.remedy.fields["poses"] == "row-vectors"
    assert_same(read_cameras(path, poses="row-vectors").entries, [replace(c, distortion=np.zeros(0)) for c in RIG])


def test_pixels_that_matlab_counts_from_one_are_noted(tmp_path):
    assert "MATLAB counts pixels from 1" in read_cameras(dannce(tmp_path, RIG)).notes[0]
    (tmp_path / "jarvis").mkdir()
    assert read_cameras(jarvis(tmp_path / "jarvis", RIG)).notes == ()


def test_dannce_corrected_by_half_is_refused(tmp_path):
    path = dannce(tmp_path, RIG)
    data = json.loads(path.read_text())
    to_json(path, {name: row | {"K": np.transpose(row["K"])} for name, row in data.items()})
    with pytest.raises(CalibrationError, match="see no one place"):
        read_cameras(path)


@pytest.mark.slow
def test_five_hundred_cameras(tmp_path):
    rig = cameras(ring(525), LENS)
    for name in ("CMU Panoptic", "anipose, Pose2Sim (`Calib.toml`)"):
        path = WRITERS[name](tmp_path, rig)
        path.write_text(path.read_text() + "\n" * 500_000)  # blanks of a generous program
        assert len(read_cameras(path).entries) == 525


def test_the_document_lists_the_table():
    text = (Path(__file__).resolve().parents[4] / "docs" / "log" / "recordings.md").read_text("utf-8")
    assert calibration_table() in text


def halves():
    """The lenses and the poses of a rig, by its cameras' names."""
    lenses, poses = {}, {}
    for c in cameras(ring(4)):
        K, distortion, R, t = parts(c)
        lenses[c.name], poses[c.name] = {"K": K, "dist": distortion, "size": c.size}, {"R": R, "t": t}
    return lenses, poses, {name: lenses[name] | poses[name] for name in lenses}


@pytest.mark.parametrize(
    "lay",
    [
        lambda lenses, poses, _: {"intrinsics": lenses, "extrinsics": poses},
        lambda lenses, poses, _: {"cameras": lenses, "poses": poses},
        lambda *halves: {"results": {"cameras": halves[2]}},
        lambda *halves: {"calibration": halves[2], "date": "2024"},
        lambda lenses, poses, _: {
            name: lenses[name] | {"c2w": rigid.inverse(rigid.transform(p["R"], p["t"])).ravel()}
            for name, p in poses.items()
        },
    ],
)
def test_cameras_in_groups_of_other_names(tmp_path, lay):
    entries = read_cameras(to_json(tmp_path / "c.json", lay(*halves()))).entries
    assert [e.name for e in entries] == [c.name for c in cameras(ring(4))]
    np.testing.assert_allclose([e.T_world_camera for e in entries], ring(4), atol=1e-6)


def test_a_name_is_there_once(tmp_path):
    rows = [{"name": "same", **row} for row in halves()[2].values()]
    with pytest.raises(CalibrationError, match="two cameras are named 'same'"):
        read_cameras(to_json(tmp_path / "c.json", rows))
    text = to_json(tmp_path / "c.json", halves()[2]).read_text()
    for path in (tmp_path / "c.json", tmp_path / "c.yml"):
        path.write_text(("---\n" if path.suffix == ".yml" else "") + text.replace('"cam1"', '"cam0"'))
        with pytest.raises(CalibrationError, match="'cam0' is there twice"):
            read_cameras(path)
