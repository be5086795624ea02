"""Cameras written in the layouts of other programs are read back as they were."""

import numpy as np
import pytest
from rigs import cameras, ring

from tracker.formats.calibrations.reading import read_cameras
from tracker.formats.calibrations.writing import LAYOUT_TEXTS, write_layout

LENSES = [((), False), ((-0.3, 0.1, 0.002, -0.003, 0.02), False), ((0.02, -0.01, 0.004, -0.001), True)]
NAMES = {"caliscope": "cam_{}"}
"""Caliscope numbers its cameras."""


def rig(distortion, fisheye):
    from dataclasses import replace

    return [replace(c, fisheye=fisheye) for c in cameras(ring(4), distortion)]


@pytest.mark.parametrize(("distortion", "fisheye"), LENSES)
@pytest.mark.parametrize("layout", LAYOUT_TEXTS)
def test_a_layout_is_read_back(tmp_path, layout, distortion, fisheye):
    expected = rig(distortion, fisheye)
    path = tmp_path / "calibration"
    write_layout(path, layout, expected)
    reading = read_cameras(path)
    assert reading.left_out == {}
    for i, (entry, camera) in enumerate(zip(reading.entries, expected, strict=True)):
        assert entry.name == NAMES.get(layout, "cam{}").format(i)
        assert entry.size == camera.size
        assert entry.fisheye == camera.fisheye
        np.testing.assert_allclose(entry.K, camera.K, rtol=1e-12)
        np.testing.assert_allclose(entry.T_world_camera, camera.T_world_camera, atol=1e-12)
        n = camera.distortion.size
        np.testing.assert_allclose(entry.distortion[:n], camera.distortion, rtol=1e-12)
        assert not entry.distortion[n:].any()


def test_odd_names_have_groups_in_opencvs_file(tmp_path):
    from dataclasses import replace

    expected = [replace(c, name=f"links {i}") for i, c in enumerate(rig((), False))]
    write_layout(tmp_path / "rig.yml", "opencv", expected)
    assert [e.name for e in read_cameras(tmp_path / "rig.yml").entries] == [c.name for c in expected]
