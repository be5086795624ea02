"""Units of translations: named by the distance to the point at which the cameras look."""

import json
from dataclasses import replace

import numpy as np
import pytest
from calibration_files import anipose, egoexo, opencv_words
from rigs import K as RIG_K
from rigs import cameras, looking, ring

from tracker.errors import CalibrationError
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid


def in_units(factor, rig=None):
    """Cameras whose translations count other units than metres."""
    return cameras([rigid.transform(T[:3, :3], factor * T[:3, 3]) for T in (rig or ring(4))])


@pytest.mark.parametrize(
    ("factor", "units", "remedy"),
    [
        (100, None, "cm (4 m)"),
        (1000, None, "cm (40 m)"),
        (100, "mm", "cm (4 m)"),
        (1, "mm", "m (4 m)"),
        (1, "cm", "m (4 m)"),
        (1e6, None, "m, cm, mm"),
    ],
)
def test_a_wrong_unit_names_those_that_fit(tmp_path, factor, units, remedy):
    path = opencv_words(tmp_path, in_units(factor))
    with pytest.raises(
        CalibrationError, match=r"from the point at which they look, found .* unit is another"
    ) as caught:
        read_cameras(path, units)
    assert remedy in caught.value.remedy.fields["units"]


def test_millimetres_are_offered_before_farther_centimetres(tmp_path):
    with pytest.raises(CalibrationError) as caught:
        read_cameras(opencv_words(tmp_path, in_units(1000)))
    assert caught.value.remedy.fields["units"].startswith("mm (4 m)")


@pytest.mark.parametrize(("factor", "units"), [(1, None), (100, "cm"), (1000, "mm")])
def test_the_right_unit(tmp_path, factor, units):
    reading = read_cameras(opencv_words(tmp_path, in_units(factor)), units)
    np.testing.assert_allclose([e.T_world_camera for e in reading.entries], ring(4), atol=1e-9)
    assert reading.notes == ()


def test_squares_of_the_board_are_noted_and_no_unit_is_advised(tmp_path):
    path = anipose(tmp_path, in_units(1 / 0.058), {"charuco_square_size": 1})
    (note,) = read_cameras(path).notes
    assert "stand 69.5 m" in note
    assert "a square of its board is 1 wide" in note
    with pytest.raises(CalibrationError, match="multiply the translations by the side of a square") as caught:
        read_cameras(path, "mm")
    assert caught.value.remedy is None


def test_parallel_cameras_have_no_point_but_an_extent(tmp_path):
    row = [looking([x, 0, 0], [x, 4.0, 0]) for x in (0.0, 0.065)]
    path = opencv_words(tmp_path, in_units(1000, row))
    assert "within 0.065 m" in read_cameras(path, "mm").notes[-1]
    with pytest.raises(CalibrationError, match="within 60 m from the origin"):
        read_cameras(opencv_words(tmp_path, in_units(10_000, row)))


@pytest.mark.parametrize(("word", "per_metre"), [("cm", 100), ("millimeters", 1000), ("Inch", 1 / 0.0254)])
@pytest.mark.parametrize("place", ["file", "metadata", "camera"])
def test_the_unit_that_a_file_states(tmp_path, word, per_metre, place):
    path = opencv_words(tmp_path, in_units(per_metre))
    rows = json.loads(path.read_text())
    said = {"units": word}
    whole = {"file": {"cameras": rows, **said}, "metadata": {"cameras": rows, "metadata": said}}
    path.write_text(json.dumps(whole.get(place, {name: row | said for name, row in rows.items()})))
    reading = read_cameras(path)
    np.testing.assert_allclose([e.T_world_camera for e in reading.entries], ring(4), atol=1e-9)
    with pytest.raises(CalibrationError, match="unit is another"):  # the user's word goes before the file's
        read_cameras(path, "mm" if word == "cm" else "m")


def test_a_stated_unit_that_is_not_known_is_refused(tmp_path):
    path = opencv_words(tmp_path, in_units(1))
    rows = json.loads(path.read_text())
    path.write_text(json.dumps({"cameras": rows, "units": "squares"}))
    with pytest.raises(CalibrationError, match="ft, found 'squares'"):
        read_cameras(path)
    path.write_text(
        json.dumps(
            {name: row | {"unit": unit} for (name, row), unit in zip(rows.items(), ["m", "cm", "m", "m"], strict=True)}
        )
    )
    with pytest.raises(CalibrationError, match="found 'cm' and 'm'"):
        read_cameras(path)


@pytest.mark.parametrize(("factor", "limit"), [(0.001, "at least 0.5"), (0.1, "at least 0.5"), (16, "within 60")])
def test_rooms_of_unusual_size_need_a_word(tmp_path, factor, limit):
    path = opencv_words(tmp_path, in_units(factor))
    with pytest.raises(CalibrationError, match=f"expected cameras {limit} m from the point"):
        read_cameras(path)
    (note,) = read_cameras(path, any_size=True).notes
    assert "check that the unit is metres" in note


@pytest.mark.parametrize(
    ("factor", "k1", "fisheye", "low"),
    [(0.25, 0.1, False, 0.3), (0.17, 0.0, False, 0.18), (6.0, 0.1, False, 0.3), (6.0, 0.1, True, 0.3)],
)
def test_unusual_focal_lengths_need_a_word(tmp_path, factor, k1, fisheye, low):
    K = np.diag([factor * 1.28, factor * 1.28, 1.0]) @ RIG_K  # 500 px of 640 are 0.78
    K[:2, 2] = RIG_K[:2, 2]
    lens = {"K": K, "distortion": np.array([k1, 0.0, 0.0, 0.0])}
    path = opencv_words(tmp_path, [replace(c, **lens) for c in cameras(ring(4))])
    rows = json.loads(path.read_text())
    path.write_text(json.dumps({name: row | {"fisheye": fisheye} for name, row in rows.items()}))
    with pytest.raises(CalibrationError, match=f"focal length of {low} to 5 times the longer side .* found") as caught:
        read_cameras(path)
    assert caught.value.remedy.code == "any_size"
    assert len(read_cameras(path, any_size=True).entries) == 4


def test_short_fisheyes_are_usual(tmp_path):
    K = RIG_K.copy()
    K[0, 0] = K[1, 1] = 170.0
    rig = [replace(c, K=K, fisheye=True, distortion=np.zeros(4)) for c in cameras(ring(4))]
    assert len(read_cameras(egoexo(tmp_path, rig)).entries) == 4
