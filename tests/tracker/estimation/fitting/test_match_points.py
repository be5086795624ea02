from dataclasses import replace

import numpy as np
import pytest
from staging import at, camera_at, cameras_around, own_evidence, posed, solid

from tracker.body.model import PosedBody
from tracker.estimation.fitting.contour_arrays import N_COLUMNS, points_to_match
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.silhouette_contour import SilhouetteContour
from tracker.evidence.view_evidence import Silhouette, ViewEvidence
from tracker.formats.model_toml import load_model

FRONT = camera_at("front", (4.0, 0.0, 0.0))
BALL = [at(solid((0.3, 0.3, 0.3)), 0, 0, 0)]
EDGES, SILHOUETTE = 1.0, 0.5
ACROSS = (1.0, 0.0)


def table(points, normal=ACROSS):
    points = np.reshape(np.asarray(points, np.float32), (-1, 2))
    return points, np.tile(np.float32(normal), (len(points), 1))


def shown(edges, outline, turned=0.0, trust=1.0):
    """A view of an upright edge and of a silhouette's contour, turned by an angle, rad."""
    points, normals = table(outline, (np.cos(turned), np.sin(turned)))
    silhouette = Silhouette(
        np.zeros((480, 640), bool), points, normals, trust, SilhouetteContour(points, normals), 40.0
    )
    return ViewEvidence(FRONT, 1.0, table(edges)[0], np.zeros((480, 640), np.float32), normals=table(edges)[1],
                        silhouette=silhouette)  # fmt: skip


def found(*args, reach=np.inf, **kwargs):
    contour = None if np.isinf(reach) else occluding_contours.trace(BALL, FRONT)
    return points_to_match(shown(*args, **kwargs), contour, reach, EDGES, SILHOUETTE).tolist()


def test_a_point_of_the_silhouette_joins_the_edge_it_lies_on():
    (point,) = found([[100, 50]], [[101.5, 50]], trust=0.5)
    assert point == pytest.approx([100.3, 50, 1, 0, 1.25, 2])
    # Which side is brighter the silhouette does not know.
    assert len(found([[100, 50]], [[101.5, 50]], turned=np.pi)) == 1


@pytest.mark.parametrize(
    ("outline", "turned"), [([102.5, 50], 0.0), ([101, 50], 0.6), ([100, 57], 0.0)], ids=["beside", "aslant", "along"]
)
def test_separate_or_crossing_tracks_stay_apart(outline, turned):
    first, second = found([[100, 50]], [outline], turned=turned)
    assert first == pytest.approx([100, 50, 1, 0, 1, 1])
    assert second == pytest.approx([*outline, np.cos(turned), np.sin(turned), 0.5, 1])


def test_each_joins_the_nearest_and_several_may_join_one():
    points = found([[100, 50], [100, 54]], [[101, 51], [101, 55], [101, 53]])
    assert [p[4:] for p in points] == [[1.5, 2], [2, 3]]
    assert points[1][:2] == pytest.approx([100.5, 54.0])  # as heavy as the two points of the silhouette around it


def test_a_silhouette_of_no_trust_says_nothing():
    assert found([[100, 50]], [[101, 50], [300, 50]], trust=0.0) == [[100, 50, 1, 0, 1, 1]]


def test_only_what_is_near_a_contour_is_kept():
    on_ball, far = [319.0 + 520 * np.tan(np.arcsin(0.3 / 4.0)), 239.0], [100.0, 50.0]
    assert [p[:2] for p in found([on_ball, far], [far], reach=20.0)] == [pytest.approx(on_ball)]


def test_joined_points_weigh_what_they_did_apart():
    """On a body's own contours, with a silhouette that is a pixel off: whatever was there is there, once."""
    bodies = [PosedBody(m := load_model("gavrila22"), posed(m, 1))]
    view = own_evidence(bodies, cameras_around())[0]
    points = view.points_px[::2] + view.normals[::2]
    inside = np.all((points >= 0) & (points < view.camera.size), axis=1)
    points, normals = points[inside], view.normals[::2][inside]
    silhouette = Silhouette(
        np.zeros(view.distance.shape, bool), points, normals, 1.0, SilhouetteContour(points, normals), 40.0
    )
    joined = points_to_match(replace(view, silhouette=silhouette), None, np.inf, EDGES, SILHOUETTE)
    assert joined.shape == (len(view.points_px), N_COLUMNS)  # all found their edges
    np.testing.assert_allclose(
        joined[:, 4:].sum(axis=0), [len(view.points_px) + 0.5 * len(points), len(view.points_px) + len(points)]
    )
