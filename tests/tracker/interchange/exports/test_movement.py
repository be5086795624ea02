"""Datasets of movement, read by xarray, and by movement where a Python has it."""

import os
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from bodies import MODELS, with_center
from foreign import foreign, projected
from stored_motions import FPS, store_motion

from tracker.errors import FormatError
from tracker.formats.write_only import optional_packages
from tracker.geometry import rigid
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion
from tracker.interchange.exports.writers import write_movement

DIMENSIONS = ("time", "space", "keypoints", "individuals")
"""Of movement's schema (movement.validators.datasets.ValidPosesInputs)."""
MOVEMENT = os.environ.get("MOVEMENT_PYTHON", "")
CHECK = """
import sys
import xarray
from movement.filtering import filter_by_confidence
from movement.kinematics import compute_velocity
from movement.validators.datasets import ValidPosesInputs
for path in sys.argv[1:]:
    found = xarray.open_dataset(path)
    ValidPosesInputs.validate(found)
    assert compute_velocity(found.position).shape == found.position.shape
    assert filter_by_confidence(found.position, found.confidence, threshold=0.5).notnull().any()
"""


@pytest.fixture
def written(tmp_path):
    foreign("h5netcdf")
    model = with_center(MODELS["gavrila38"], "left_hip", (0.01, 0.02, -0.03))
    session, truth = store_motion(tmp_path / "s", [model, MODELS["gavrila22"]], gaps={(0, 3)}, lost={(1, 5)})
    first = session.cameras[0]
    narrow = replace(first, camera=replace(first.camera, size=(320, 480)))  # it films a half of the people
    session = replace(session, cameras=(narrow, *session.cameras[1:]))
    paths = [tmp_path / "a.nc", tmp_path / "a_views.nc"]
    motion = read_motion(session, (0, 1), range(2, 7))
    write_movement(motion, ExportOptions("y-up"), paths, lambda: None)
    return session, truth, paths


@pytest.mark.slow
def test_xarray_finds_the_joint_centers_and_their_provenance(written):
    session, truth, paths = written
    dataset = foreign("xarray").open_dataset(paths[0])
    assert dataset.position.dims == DIMENSIONS
    assert dataset.confidence.dims == ("time", "keypoints", "individuals")
    assert [dataset.attrs[k] for k in ("ds_type", "fps", "time_unit", "source_software")] == [
        "poses", FPS, "seconds", "Quadrille"
    ]  # fmt: skip
    assert dataset.space.values.tolist() == ["x", "y", "z"]
    assert dataset.individuals.values.tolist() == ["ann", "bob"]
    np.testing.assert_allclose(dataset.time, np.arange(2, 7) / FPS)
    T = file_from_world(session, "y-up")
    for i, name in enumerate(("ann", "bob")):
        for frame in range(2, 7):
            at = dataset.sel(individuals=name).isel(time=frame - 2)
            assert int(at.frame) == frame
            if frame not in truth[i]:
                assert np.isnan(at.position).all()
                assert np.isnan(at.confidence).all()
                continue
            body = truth[i][frame]
            places = at.position.sel(keypoints=list(body.model.point_names)).transpose("keypoints", "space")
            np.testing.assert_allclose(places, rigid.apply(T, body.joint_centers_world), atol=1e-4)
    assert dataset.status.sel(individuals="bob").values.tolist() == ["good", "good", "good", "lost", "good"]
    assert set(np.unique(dataset.point_source)) == {"", "tracked", "manual"}


@pytest.mark.slow
def test_points_of_all_views_are_where_the_footage_shows_them(written):
    session, truth, paths = written
    dataset = foreign("xarray").open_dataset(paths[1])
    assert dataset.position.dims == ("view", *DIMENSIONS)
    assert dataset.attrs["space_unit"] == "pixels"
    n_checked = 0
    for source in session.cameras:
        for frame, body in truth[0].items():
            if not 2 <= frame < 7:
                continue
            at = dataset.sel(view=source.camera.name, individuals="ann").isel(time=frame - 2)
            for name, place in zip(body.model.point_names, body.joint_centers_world, strict=True):
                px = at.position.sel(keypoints=name).values
                assert (int(at.visibility.sel(keypoints=name)) > 0) == bool(np.isfinite(px).all())
                expected = projected(source.camera, place)
                inside = ((expected > -0.5) & (expected < np.array(source.camera.size) - 0.5)).all()
                assert np.isfinite(px).all() == inside
                if inside:
                    np.testing.assert_allclose(px, expected, atol=0.1)
                    n_checked += 1
    assert n_checked > 100


@pytest.mark.slow
@pytest.mark.skipif(not MOVEMENT, reason="MOVEMENT_PYTHON names no Python that has movement, which fills 1.4 GB")
def test_movement_validates_and_uses_them(written):
    done = subprocess.run([MOVEMENT, "-c", CHECK, *written[2]], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_missing_package_leaves_no_dataset(tmp_path, monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name)

    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila22"]], n_frames=2)
    monkeypatch.setattr(optional_packages, "import_module", missing)
    motion, paths = read_motion(session, (0,)), [tmp_path / "a.nc", tmp_path / "b.nc"]
    with pytest.raises(FormatError, match="expected the package h5netcdf to write netCDF, found none"):
        write_movement(motion, ExportOptions(), paths, lambda: None)
