"""C3D files, read by ezc3d."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import MODELS, with_center
from foreign import foreign
from stored_motions import store_motion

from tracker.errors import FormatError, Remedy
from tracker.formats.write_only import c3d, optional_packages
from tracker.geometry import rigid
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion
from tracker.interchange.exports.writers import write_person_c3d
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange


@pytest.mark.slow
@pytest.mark.parametrize(("axes", "units"), [("calibration", "mm"), ("y-up", "m")])
def test_ezc3d_finds_the_joint_centers_labels_units_rate_and_residuals(tmp_path, axes, units):
    model = with_center(MODELS["gavrila38"], "left_hip", (0.01, 0.02, -0.03))
    session, truth = store_motion(tmp_path / "s", [model], gaps={(0, 3)})
    session = replace(session, fps=29.97)  # a rate that is no whole number
    errors = np.full((len(model.point_names), 3, 3), np.diag([0.01, 0.02, 0.02]) ** 2)
    with AnnotationStore(session.annotations_path) as store:
        store.commit("Assess", [PoseChange("ann", 4, replace(store.pose("ann", 4), errors=errors))])
    motion = read_motion(session, (0,), range(2, 7))
    write_person_c3d(motion, ExportOptions(axes, units), [tmp_path / "a.c3d"], lambda: None)
    file = foreign("ezc3d").c3d(str(tmp_path / "a.c3d"))
    per_metre = {"mm": 1000, "m": 1}[units]
    assert file["parameters"]["POINT"]["UNITS"]["value"] == [units]
    assert file["parameters"]["POINT"]["LABELS"]["value"] == list(model.point_names)
    header = file["header"]["points"]
    assert (header["first_frame"], header["last_frame"]) == (2, 6)
    assert header["frame_rate"] == pytest.approx(29.97, rel=1e-6)
    T = file_from_world(session, axes)
    for i, frame in enumerate(range(2, 7)):
        found = file["data"]["points"][:3, :, i].T
        residuals = file["data"]["meta_points"]["residuals"][0, :, i]
        if frame == 3:
            assert np.isnan(found).all()
            assert (residuals == -1).all()
            continue
        expected = per_metre * rigid.apply(T, truth[0][frame].joint_centers_world)
        np.testing.assert_allclose(found, expected, atol=1e-4 * per_metre)
        np.testing.assert_allclose(residuals, 0.03 * per_metre * (frame == 4), atol=0.001 * per_metre)


@pytest.mark.slow
def test_frame_numbers_that_the_file_would_cut_are_refused(tmp_path):
    foreign("ezc3d")
    points = np.zeros((3, 1, 3))
    c3d.write_c3d(tmp_path / "a.c3d", ["a"], points, 25.0, first_frame=65532)
    with pytest.raises(FormatError, match="expected frame numbers up to 65,535, as C3D has, found 65,536") as caught:
        c3d.write_c3d(tmp_path / "b.c3d", ["a"], points, 25.0, first_frame=65533)
    assert caught.value.remedy == Remedy("fewer_frames")
    assert not (tmp_path / "b.c3d").exists()


@pytest.mark.slow
def test_a_file_that_was_cut_is_noticed(tmp_path, monkeypatch):
    foreign("ezc3d")
    monkeypatch.setattr(c3d, "MAX_FRAME", 10**6)
    with pytest.raises(FormatError, match="on 65536 frames from 0 in the C3D file, read back 1 on"):
        c3d.write_c3d(tmp_path / "a.c3d", ["a"], np.zeros((65536, 1, 3)), 25.0)


def test_a_missing_package_is_one_sentence(tmp_path):
    with pytest.raises(FormatError) as caught:
        optional_packages.require("no_such_package", "C3D")
    assert str(caught.value) == "expected the package no_such_package to write C3D, found none"
    assert caught.value.remedy == Remedy("install_extra", extra="export")
