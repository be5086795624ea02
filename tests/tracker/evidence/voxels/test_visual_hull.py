import re
from dataclasses import replace

import numpy as np
import pytest
from solids import cameras_around, ellipsoid, silhouettes_of

from tracker.errors import TrackerError
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.geometry import rigid

MAN, WOMAN = ellipsoid((-0.4, 0, 0), np.array([0.15, 0.2, 0.4])), ellipsoid((0.4, 0, 0), np.array([0.12, 0.18, 0.35]))
CAMERAS = cameras_around(6, focal=250.0)
SIZE_M = 0.03


@pytest.mark.slow
def test_two_people_who_stand_apart_are_two_figures():
    hull = carve_people(silhouettes_of([WOMAN, MAN], CAMERAS), SIZE_M)
    assert [np.sign(f.points_world[:, 0].mean()) for f in hull.figures] == [-1, 1]
    assert hull.coverages.min() > 0.95
    assert not hull.broken


@pytest.mark.slow
def test_a_broken_view_is_left_out():
    views = silhouettes_of([MAN], CAMERAS)
    holed = views[2].mask.copy()
    rows = np.flatnonzero(holed.any(axis=1))
    holed[rows[len(rows) // 3] :] = False
    hull = carve_people([*views[:2], views[2]._replace(mask=holed), *views[3:]], SIZE_M)
    whole = carve_people(views, SIZE_M)
    assert (hull.broken, hull.is_covered) == (("c2",), True)
    assert hull.least_explained is None
    assert 0.9 < hull.figures[0].volume_m3 / whole.figures[0].volume_m3 < 1.3


@pytest.mark.slow
def test_a_silhouette_that_shows_more_than_people_is_explained_least():
    views = silhouettes_of([MAN], CAMERAS)
    for i, extra in ((1, 1), (4, 2)):
        mask = views[i].mask.copy()
        rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
        mask[rows[0] : rows[-1], columns[-1] : columns[-1] + extra * (columns[-1] - columns[0]) // 4] = True
        views[i] = views[i]._replace(mask=mask)
    assert carve_people(views, SIZE_M).least_explained == 4


def turned(view, radians):
    """The same silhouette in a camera that is not where its calibration says."""
    T = view.camera.T_world_camera @ rigid.transform(rigid.so3_exp(np.array([0.0, radians, 0.0])))
    return view._replace(camera=replace(view.camera, T_world_camera=T))


@pytest.mark.slow
@pytest.mark.parametrize("radians", [0.05, 0.15])
def test_a_camera_that_moved_is_left_out(radians):
    """Turned a little, its silhouette meets the others in part; turned farther, not at all."""
    views = silhouettes_of([MAN], CAMERAS)
    hull = carve_people([views[0], turned(views[1], radians), *views[2:]], SIZE_M)
    assert (hull.broken, hull.is_covered) == (("c1",), False)
    assert hull.coverages[[0, 2, 3, 4, 5]].min() > 0.95


@pytest.mark.slow
def test_several_cameras_that_moved_are_an_error():
    views = silhouettes_of([MAN], CAMERAS)
    with pytest.raises(TrackerError, match="no camera has moved"):
        carve_people([*views[:3], turned(views[3], 0.3), turned(views[4], -0.3), turned(views[5], 0.3)], SIZE_M)


def test_no_view_is_left_out_where_several_could_be():
    """Any two of three views at one height agree in space, so that nothing tells which of them is broken."""
    views = silhouettes_of([MAN], cameras_around(101, focal=250.0)[49:52])
    with pytest.raises(TrackerError, match="no camera has moved"):
        carve_people([views[0], turned(views[1], 0.15), views[2]], SIZE_M)


@pytest.mark.slow
def test_the_silhouette_that_is_explained_least_is_named():
    views = silhouettes_of([MAN], CAMERAS)
    for i, margin in ((1, 20), (4, 10)):
        mask = np.zeros_like(views[i].mask)
        mask[margin:-margin, margin:-margin] = True
        views[i] = views[i]._replace(mask=mask)
    with pytest.raises(TrackerError, match=r"the others hardly explain \(c1 \d+%, c4 \d+%\)") as error:
        carve_people(views, SIZE_M)
    assert error.value.camera == "c4"


def test_nothing_of_the_size_of_a_person():
    with pytest.raises(TrackerError, match="a figure of at least 8 litres"):
        carve_people(silhouettes_of([ellipsoid((0, 0, 0), np.full(3, 0.1))], CAMERAS), SIZE_M)


@pytest.mark.slow
def test_a_refusal_does_not_contradict_itself():
    """Three pieces of 4 litres each are no figure; "at least 8 litres, found 12" would be."""
    pieces = [ellipsoid((0.7 * i, 0, 0), np.full(3, 0.1)) for i in (-1, 0, 1)]
    with pytest.raises(TrackerError, match="a figure of at least 8 litres") as error:
        carve_people(silhouettes_of(pieces, CAMERAS), SIZE_M)
    found = float(re.search(r"at most ([\d.]+) litres", str(error.value))[1])
    assert 3 < found < 8


@pytest.mark.slow
def test_a_small_child_is_a_figure():
    child = ellipsoid((0, 0, 0), np.array([0.09, 0.11, 0.33]))
    assert carve_people(silhouettes_of([child], CAMERAS), SIZE_M).figures[0].volume_m3 < 0.02
