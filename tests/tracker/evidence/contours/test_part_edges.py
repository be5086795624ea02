import numpy as np
import pytest
from scipy.spatial import cKDTree
from staging import at, camera_at, own_evidence, solid

from tracker.body.model import PosedBody
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours import part_edges as part_edges_module
from tracker.evidence.contours.part_edges import part_edges, points_occluded

FRONT = camera_at("front", (4.0, 0.0, 0.0))
RADIUS, HALF_APART = 0.2, 0.12


def two_balls():
    """Two spheres that intersect in a circle in the plane y = 0."""
    model = solid((RADIUS,) * 3)
    return [at(model, 0, -HALF_APART, 0), at(model, 0, HALF_APART, 0)]


def seam(n=2000):
    """The circle in which the spheres intersect, its half that faces FRONT, (n, 3)."""
    a = np.linspace(-np.pi / 2, np.pi / 2, n)
    return np.sqrt(RADIUS**2 - HALF_APART**2) * np.stack([np.cos(a), 0 * a, np.sin(a)], axis=1)


def dense(pieces_px):
    t = np.linspace(0, 1, 5)[:, None, None]
    return (pieces_px[:, :2] + t * (pieces_px[:, 2:] - pieces_px[:, :2])).reshape(-1, 2)


def test_part_edges_lie_on_both_surfaces():
    found = dense(part_edges(two_balls(), [FRONT])[0])
    circle = FRONT.project(seam())
    # The grid's cells are 15 degrees wide: its chords stray by up to 2% of the radius of 26 px.
    assert cKDTree(circle).query(found)[0].max() < 0.6
    # Seen from the side, the circle is whole but for its ends at the outline, where the lift off the surfaces ends.
    side = camera_at("side", (4.0, 1.5, 0.0))
    from_side = dense(part_edges(two_balls(), [side])[0])
    assert cKDTree(side.project(seam(4000))).query(from_side)[0].max() < 0.6
    seen = side.project(seam()[400:1600])
    assert cKDTree(from_side).query(seen)[0].max() < 1.5


def test_part_edges_hidden_by_another_body():
    screen = at(solid((0.05, 0.5, 0.5), name="screen"), 1, 0, 0)
    assert len(part_edges([*two_balls(), screen], [FRONT])[0]) == 0
    assert len(part_edges([*two_balls(), at(screen.model, -1, 0, 0)], [FRONT])[0]) == len(
        part_edges(two_balls(), [FRONT])[0]
    )


def test_no_part_edges_between_parts_apart():
    model = solid((RADIUS,) * 3)
    assert part_edges([at(model, 0, -0.3, 0), at(model, 0, 0.3, 0)], [FRONT])[0].shape == (0, 4)


def test_part_edges_never_enter_the_cost():
    bodies = two_balls()
    # The seam runs far from the outlines, of which alone the edges are made: were it scored, it would cost.
    seen = occluding_contours.trace(bodies, FRONT)
    apart = cKDTree(dense(seen.pieces_px[~seen.occluded])).query(dense(part_edges(bodies, [FRONT])[0]))[0]
    assert apart.mean() > 8
    cost = ChamferCost(own_evidence(bodies, [FRONT]), bodies)([b.values for b in bodies])
    assert cost.total_px < 0.5


def test_points_hidden(gavrila):
    body = PosedBody(gavrila, gavrila.neutral())
    place = gavrila.named_points_world(body.values)
    side = camera_at("side", (0.0, 4.0, 0.0))  # at the body's left
    occluded = dict(zip(place, points_occluded([body], [side], np.stack(list(place.values())))[0], strict=True))
    # The left side hides the right: the trunk its arm, the legs one another. The forearm hangs before the hip.
    assert [n for n, h in occluded.items() if n.startswith("left") and h] == ["left_hip"]
    assert occluded["right_shoulder"]
    assert occluded["right_knee"]
    assert occluded["right_wrist"]
    # A joint lies within the parts around it; those do not hide it.
    assert not points_occluded([body], [camera_at("front", (4.0, 0.0, 0.0))], np.stack(list(place.values()))).any()


def test_points_hidden_by_another_person():
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.5, 0.0]])  # behind, before and beside
    screen = at(solid((0.05, 0.3, 0.3)), 1, 0, 0)
    assert points_occluded([screen], [FRONT], points).tolist() == [[True, False, False]]
    assert points_occluded([at(screen.model, 6, 0, 0)], [FRONT], points).tolist() == [[False] * 3]  # behind the camera


@pytest.mark.slow
def test_points_hidden_in_several_views_are_those_whose_sight_passes_a_part(gavrila):
    rng = np.random.default_rng(4)
    near = rng.normal(0.0, 0.2, gavrila.n_dofs)
    bodies = [PosedBody(gavrila, gavrila.clip(gavrila.retract(gavrila.neutral(), s * near))) for s in (1.0, -1.0)]
    points = rng.uniform((-0.4, -0.4, -0.8), (0.4, 0.4, 0.8), (200, 3))
    views = [FRONT, camera_at("side", (0.0, 4.0, 0.0))]
    occluded = points_occluded(bodies, views, points)
    for view, found in zip(views, occluded, strict=True):
        # The sight as many places: whether one is within a part that does not hold the point.
        sight = points + np.linspace(0.0, 1.0, 4000)[:, None, None] * (view.center_world - points)
        wanted = np.zeros(len(points), bool)
        for body in bodies:
            Ts = body.model.kinematics(body.values).Ts_world_part
            for T, center, shape in zip(Ts, body.model.centers_part, body.model.shapes, strict=True):
                inside = shape.inside_outside((sight - T[:3, 3]) @ T[:3, :3] - center)
                wanted |= (inside[0] >= 1.5) & (inside.min(axis=0) < 1.0)
        assert 20 < wanted.sum() < 180
        assert np.mean(found == wanted) > 0.96  # lines that graze a part may go either way


def test_curves_are_found_once_for_all_views(monkeypatch):
    calls, zero_line = [], part_edges_module._zero_line
    monkeypatch.setattr(part_edges_module, "_zero_line", lambda *args: (calls.append(1), zero_line(*args))[1])
    side = camera_at("side", (0.0, 4.0, 0.0))
    front, across = part_edges([*two_balls(), at(two_balls()[0].model, 9, 9, 9)], [FRONT, side])
    assert len(calls) == 1  # neither for each view, nor with what is far away
    assert len(front)
    assert np.array_equal(across, part_edges(two_balls(), [side])[0])
