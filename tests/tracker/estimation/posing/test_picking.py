import cv2
import numpy as np
import pytest
from staging import camera_at, in_posture

from tracker.body.model import PosedBody
from tracker.estimation.posing.picking import part_hulls, point_on_part
from tracker.geometry import rigid

SIDE = camera_at("side", (3.0, 2.5, 1.0))


@pytest.fixture(scope="module")
def body(gavrila):
    return PosedBody(gavrila, in_posture(gavrila))


def test_outlines_hold_the_images_of_their_parts(body):
    """Against meshes finer than those of the hulls: no point is more than half a pixel outside."""
    Ts = body.model.kinematics(body.values).Ts_world_part
    found = part_hulls([body], [SIDE])[0]
    assert [o.part for o in found] == list(range(len(body.model.parts)))
    for outline in found:
        mesh = body.model.shapes[outline.part].triangles(40, 60)
        points = rigid.apply(Ts[outline.part], mesh.vertices + body.model.centers_part[outline.part])
        polygon = outline.polygon_px.astype(np.float32)
        inside = [cv2.pointPolygonTest(polygon, tuple(map(float, p)), True) for p in SIDE.project(points)]
        assert min(inside) > -0.5
        assert min(inside) < 0.5  # and it fits as closely
        assert cv2.isContourConvex(polygon)


def test_parts_behind_the_camera_have_no_outline(body):
    turned = camera_at("turned", (0.0, 0.0, 0.2))
    assert len(part_hulls([body], [turned])[0]) < len(body.model.parts)


@pytest.mark.parametrize("part", range(10))
def test_the_place_touched_is_on_the_surface_and_under_the_pointer(body, part):
    outline = next(o for o in part_hulls([body], [SIDE])[0] if o.part == part)
    T = body.model.kinematics(body.values).Ts_world_part[part]
    for toward in (0.0, 0.5, 0.9):
        pointer = outline.polygon_px.mean(axis=0) * (1 - toward) + toward * outline.polygon_px[0]
        place = point_on_part(body, SIDE, part, pointer)
        np.testing.assert_allclose(SIDE.project(rigid.apply(T, place)), pointer, atol=0.05)
        shape, center = body.model.shapes[part], body.model.centers_part[part]
        assert float(shape.inside_outside(place - center)) == pytest.approx(1, abs=0.1)
        # Of the two places on the line of sight it is the one that the camera sees: behind it the solid begins.
        sight = place - rigid.apply(rigid.inverse(T), SIDE.center_world)
        before, behind = (place + way * sight / np.linalg.norm(sight) - center for way in (-0.006, 0.006))
        assert shape.inside_outside(before) > shape.inside_outside(behind)


def test_a_pointer_that_just_misses_takes_the_outline(body):
    outline = part_hulls([body], [SIDE])[0][0]
    middle = outline.polygon_px.mean(axis=0)
    outside = middle + 1.02 * (outline.polygon_px[3] - middle)
    T = body.model.kinematics(body.values).Ts_world_part[0]
    place = point_on_part(body, SIDE, 0, outside)
    assert np.linalg.norm(SIDE.project(rigid.apply(T, place)) - outside) < 6
