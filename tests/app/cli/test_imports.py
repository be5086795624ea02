"""Commands load what they need only: large packages take most of the time of a short command."""

import subprocess
import sys

import pytest
from bodies import MODELS
from command_line import SAMPLE
from stored_motions import store_motion

LARGE = {"numba", "scipy", "viser", "aiohttp", "trimesh"}
"""Packages that no summary of a session needs."""
OF_OTHER_FORMATS = {"ezc3d", "xarray", "h5netcdf", "h5py", "pynwb", "ndx_pose", "pandas"}
"""Packages that only some formats of exports need."""
RUN = """
import sys
from app.main import main

sys.argv = ["quadrille", *sys.argv[1:]]
main()
print(*sys.modules, file=sys.stderr)
"""


@pytest.mark.parametrize(
    ("options", "unneeded"), [pytest.param([], LARGE, marks=pytest.mark.slow), (["--no-check"], LARGE | {"av"})]
)
def test_info_loads_no_kernels_and_no_decoder_it_does_not_use(options, unneeded):
    words = [sys.executable, "-c", RUN, "info", str(SAMPLE), *options]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("elbow_rotation: 50 frames")
    assert unneeded & set(done.stderr.split()) == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.trc", "a.glb", "a.npz"])
def test_an_export_loads_no_package_of_another_format(tmp_path, name):
    store_motion(tmp_path / "s", [MODELS["gavrila22"]], n_frames=2)
    words = [sys.executable, "-c", RUN, "export", str(tmp_path / "s"), "--out", str(tmp_path / name)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert (tmp_path / name).is_file()
    assert OF_OTHER_FORMATS & set(done.stderr.split()) == set()
