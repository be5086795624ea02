from dataclasses import replace

import numpy as np
import pytest
from staging import at, camera_at, own_evidence, solid

from tracker import contours
from tracker.evidence import Silhouette
from tracker.segments import Segments
from tracker.sharing import own_views
from tracker.silhouette_contour import Outline

BALL = solid((0.15, 0.15, 0.3))
FRONT = camera_at("front", (4.0, 0.0, 0.0))


def seen(bodies, camera=FRONT):
    """The contours of bodies as edges whose segments are single pixels, and as the contour of a silhouette."""
    (view,) = own_evidence(bodies, [camera])
    each = Segments(view.points_px, view.normals, np.arange(len(view.points_px) + 1))
    inside = np.zeros((camera.height, camera.width), bool)
    outline = Silhouette(inside, view.points_px, view.normals, 1.0, Outline(view.points_px, view.normals), 40.0)
    return replace(view, segments=each, silhouette=outline)


def off_px(points, body):
    """Distance of each point from the contour of a body that stands alone, px."""
    pieces = contours.trace([body], FRONT).pieces_px
    return np.linalg.norm(points[:, None] - 0.5 * (pieces[:, :2] + pieces[:, 2:]), axis=-1).min(axis=1)


def test_alone_one_has_everything():
    body = at(BALL, 0, 0, 0)
    view = seen([body])
    assert own_views([view], [body], 0)[0] is view


@pytest.mark.parametrize("person", [0, 1])
def test_what_the_other_explains_is_the_others(person):
    bodies = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)]
    view = seen(bodies)
    own = own_views([view], bodies, person)[0]
    kept = off_px(own.points_px, bodies[person])
    assert kept.max() < 4
    assert len(own.points_px) == pytest.approx(len(view.points_px) / 2, rel=0.1)
    assert off_px(own.silhouette.points_px, bodies[person]).max() < 4
    # The distance image shows the others' edges no more: at them it is as far as from one's own.
    u, v = view.points_px[off_px(view.points_px, bodies[1 - person]) < 1.5].astype(int).T
    assert own.distance[v, u].min() > 10
    assert view.distance[v, u].max() < 2


def test_what_nobody_explains_is_everybodys():
    """A third figure that nobody knows of: its edges stay with both."""
    bodies = [at(BALL, 0, -0.6, 0), at(BALL, 0, 0.6, 0)]
    stranger = at(BALL, 0, 0, 0)
    view = seen([*bodies, stranger])
    for person in (0, 1):
        (own,) = own_views([view], bodies, person, everywhere=True)
        assert (off_px(own.points_px, stranger) < 2).sum() > 20
        assert off_px(own.points_px, bodies[1 - person]).min() > 10


def test_far_from_everybody_else_nothing_is_in_reach():
    """Then nothing needs to be given away, unless poses far away are asked."""
    bodies = [at(BALL, 0, -0.6, 0), at(BALL, 0, 0.6, 0)]
    view = seen(bodies)
    assert own_views([view], bodies, 0)[0] is view
    assert len(own_views([view], bodies, 0, everywhere=True)[0].points_px) < 0.6 * len(view.points_px)


def test_what_both_explain_stays_with_both():
    """Two contours that nearly coincide share their edges; the residuals give each point to the nearer one."""
    bodies = [at(BALL, 0, 0, 0), at(BALL, 0.4, 0.01, 0)]
    view = seen(bodies)
    assert len(own_views([view], bodies, 1)[0].points_px) == len(view.points_px)


def test_a_hidden_contour_explains_nothing():
    """What the other would explain if nothing stood before it is not the other's."""
    near, far = at(BALL, 0.8, 0, 0), at(solid((0.05, 0.05, 0.1)), -0.5, 0.0, 0)
    stripe = seen([far])  # edges as of the hidden one, on the near one
    assert contours.trace([near, far], FRONT).hidden[contours.trace([near, far], FRONT).parts == 1].all()
    (own,) = own_views([stripe], [near, far], 0)
    assert len(own.points_px) == len(stripe.points_px)


def test_edges_without_direction_are_shared_by_nobody():
    bodies = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)]
    view = replace(seen(bodies), segments=None)
    assert own_views([view], bodies, 0)[0] is view
