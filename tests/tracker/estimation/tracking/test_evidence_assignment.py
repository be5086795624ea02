from dataclasses import replace

import numpy as np
import pytest
from staging import at, camera_at, own_evidence, solid

from tracker.estimation.tracking.evidence_assignment import EvidenceAssignment, EvidencePool, _assign
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.evidence.images.edge_segments import EdgeSegments, sample_segments
from tracker.evidence.images.silhouette_contour import SilhouetteContour
from tracker.evidence.view_evidence import Silhouette, with_segments

BALL = solid((0.15, 0.15, 0.3))
FRONT = camera_at("front", (4.0, 0.0, 0.0))


def seen(bodies, camera=FRONT):
    """The contours of bodies as edges whose segments are single pixels, and as the contour of a silhouette."""
    (view,) = own_evidence(bodies, [camera])
    each = EdgeSegments(view.points_px, view.normals, np.arange(len(view.points_px) + 1))
    inside = np.zeros((camera.height, camera.width), bool)
    outline = Silhouette(
        inside, view.points_px, view.normals, 1.0, SilhouetteContour(view.points_px, view.normals), 40.0
    )
    return replace(view, segments=each, samples=sample_segments(each), silhouette=outline)


def off_px(points, body):
    """Distance of each point from the contour of a body that stands alone, px."""
    pieces = occluding_contours.trace([body], FRONT).pieces_px
    return np.linalg.norm(points[:, None] - 0.5 * (pieces[:, :2] + pieces[:, 2:]), axis=-1).min(axis=1)


def mean_distances(segments, pieces, reach_px):
    """The simple version: every other pixel of each segment against every piece that runs its way, (S,)."""
    step = pieces[:, 2:] - pieces[:, :2]
    length2 = np.maximum(np.sum(step**2, axis=1), 1e-6)
    out = []
    for first, last in zip(segments.firsts[:-1], segments.firsts[1:], strict=True):
        points, normals = segments.points_px[first:last:2], segments.normals[first:last:2]
        t = np.clip(np.sum((points[:, None] - pieces[:, :2]) * step, axis=-1) / length2, 0, 1)
        off = np.linalg.norm(points[:, None] - pieces[:, :2] - t[..., None] * step, axis=-1)
        alike = np.abs(normals @ step.T) <= np.sin(np.radians(45)) * np.sqrt(length2)
        out.append(np.minimum(np.where(alike, off, np.inf).min(axis=1, initial=np.inf), reach_px).mean())
    return np.array(out)


def own_segments(view, bodies, person):
    """Which segments the simple version leaves a person, (S,), and how far from the bounds the decision is, (S,)."""
    contour, theta = occluding_contours.trace(bodies, view.camera), view.theta_px
    owners = surfaces_of(tuple(b.model for b in bodies)).people[contour.parts]
    own, others = (
        mean_distances(view.segments, contour.pieces_px[~contour.occluded & of], 2 * theta)
        for of in (owners == person, owners != person)
    )
    clear = np.minimum(np.abs(others - 0.5 * theta), np.abs(others - 0.5 * own))
    return ~((others <= 0.5 * theta) & (others < 0.5 * own)), clear


@pytest.mark.slow
@pytest.mark.parametrize("person", [0, 1, 2])
def test_the_shares_of_three_are_those_of_the_simple_version(person):
    """Segments of several pixels at random around three who hide each other, and points of a silhouette."""
    bodies = [at(BALL, 0, -0.12, 0), at(BALL, 0.5, 0.1, 0.1), at(BALL, -0.4, 0.3, -0.1)]
    rng = np.random.default_rng(4)
    points = rng.uniform((200, 120), (440, 360), (1500, 2)).astype(int).astype(np.float32)
    turns = rng.uniform(0, 2 * np.pi, 1500)
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=1).astype(np.float32)
    near = np.repeat(points[::3], 3, axis=0) + np.tile([[0, 0], [1, 1], [2, 1]], (500, 1)).astype(np.float32)
    segments = EdgeSegments(near, normals, np.arange(0, 1501, 3))
    view = seen(bodies)
    outline = replace(view.silhouette, points_px=points, normals=normals)
    view = replace(view, segments=segments, samples=sample_segments(segments), silhouette=outline)
    (own,) = EvidenceAssignment(EvidencePool([view]), bodies).own(person, everywhere=True)
    kept, clear = own_segments(view, bodies, person)
    assert 5 < np.count_nonzero(~kept) < 250
    np.testing.assert_array_equal(own.accepted[clear > 1e-3], kept[clear > 1e-3])
    segments = EdgeSegments(points, normals, np.arange(1501))
    each = replace(view, segments=segments, samples=sample_segments(segments))
    kept, clear = own_segments(each, bodies, person)
    assert clear.min() > 1e-6
    np.testing.assert_array_equal(own.silhouette.points_px, points[kept])


def test_distances_are_measured_once_for_all(monkeypatch):
    """Of two people in one pose each, in either order of calls."""
    bodies, told = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)], []
    monkeypatch.setattr(
        "tracker.estimation.tracking.evidence_assignment._assign", lambda *a: told.append(a) or _assign(*a)
    )
    shares = EvidenceAssignment(EvidencePool([seen(bodies)]), bodies)
    views = [shares.own(person, everywhere) for person in (0, 1) for everywhere in (False, True)]
    assert len(told) == 1
    assert shares.own(0) is views[0]


def test_all_edges_are_those_refused_too_but_not_the_rooms():
    bodies = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)]
    view = seen(bodies)
    n = len(view.segments.firsts) - 1
    refused, still = np.arange(n) % 3 == 0, np.arange(n) % 5 == 0
    filtered = with_segments(replace(view, is_static=still), ~refused & ~still)
    sharing = EvidencePool([filtered])
    near, everywhere = (EvidenceAssignment(sharing, bodies).own(0, everywhere=e)[0] for e in (False, True))
    whole = EvidenceAssignment(EvidencePool([view]), bodies).own(0, everywhere=True)[0].accepted
    np.testing.assert_array_equal(near.accepted, whole & ~refused & ~still)
    np.testing.assert_array_equal(everywhere.accepted, whole & ~still)
    alone = EvidenceAssignment(sharing, bodies[:1])
    assert alone.own(0)[0] is filtered
    np.testing.assert_array_equal(alone.own(0, everywhere=True)[0].accepted, ~still)


def test_alone_one_has_everything():
    body = at(BALL, 0, 0, 0)
    view = seen([body])
    assert EvidenceAssignment(EvidencePool([view]), [body]).own(0)[0] is view


@pytest.mark.parametrize("person", [0, 1])
def test_evidence_that_the_other_explains_is_the_others(person):
    bodies = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)]
    view = seen(bodies)
    own = EvidenceAssignment(EvidencePool([view]), bodies).own(person)[0]
    kept = off_px(own.points_px, bodies[person])
    assert kept.max() < 4
    assert len(own.points_px) == pytest.approx(len(view.points_px) / 2, rel=0.1)
    assert off_px(own.silhouette.points_px, bodies[person]).max() < 4
    # The distance image shows the others' edges no more: at them it is as far as from one's own.
    u, v = view.points_px[off_px(view.points_px, bodies[1 - person]) < 1.5].astype(int).T
    assert own.distance[v, u].min() > 10
    assert view.distance[v, u].max() < 2


def test_unexplained_evidence_is_everybodys():
    """A third figure that nobody knows of: its edges stay with both."""
    bodies = [at(BALL, 0, -0.6, 0), at(BALL, 0, 0.6, 0)]
    stranger = at(BALL, 0, 0, 0)
    view = seen([*bodies, stranger])
    for person in (0, 1):
        (own,) = EvidenceAssignment(EvidencePool([view]), bodies).own(person, everywhere=True)
        assert (off_px(own.points_px, stranger) < 2).sum() > 20
        assert off_px(own.points_px, bodies[1 - person]).min() > 10


def test_far_from_everybody_else_nothing_is_in_reach():
    """Then nothing needs to be given away, unless poses far away are asked."""
    bodies = [at(BALL, 0, -0.6, 0), at(BALL, 0, 0.6, 0)]
    view = seen(bodies)
    assert EvidenceAssignment(EvidencePool([view]), bodies).own(0)[0] is view
    assert len(EvidenceAssignment(EvidencePool([view]), bodies).own(0, everywhere=True)[0].points_px) < 0.6 * len(
        view.points_px
    )


def test_evidence_that_both_explain_stays_with_both():
    """Two contours that nearly coincide share their edges; the residuals give each point to the nearer one."""
    bodies = [at(BALL, 0, 0, 0), at(BALL, 0.4, 0.01, 0)]
    view = seen(bodies)
    assert len(EvidenceAssignment(EvidencePool([view]), bodies).own(1)[0].points_px) == len(view.points_px)


def test_a_hidden_contour_explains_nothing():
    """What the other would explain if nothing stood before it is not the other's."""
    near, far = at(BALL, 0.8, 0, 0), at(solid((0.05, 0.05, 0.1)), -0.5, 0.0, 0)
    stripe = seen([far])  # edges as of the hidden one, on the near one
    assert (
        occluding_contours.trace([near, far], FRONT)
        .occluded[occluding_contours.trace([near, far], FRONT).parts == 1]
        .all()
    )
    (own,) = EvidenceAssignment(EvidencePool([stripe]), [near, far]).own(0)
    assert len(own.points_px) == len(stripe.points_px)


def test_edges_without_direction_are_shared_by_nobody():
    bodies = [at(BALL, 0, -0.25, 0), at(BALL, 0, 0.25, 0)]
    view = replace(seen(bodies), segments=None, samples=None)
    assert EvidenceAssignment(EvidencePool([view]), bodies).own(0)[0] is view
