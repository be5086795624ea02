import chamfer_oracle as oracle
import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree
from staging import at, camera_at, cameras_around, own_evidence, posed, shaken, solid, view_evidence

from tracker.body.model import PosedBody
from tracker.estimation.search.chamfer_cost import ChamferCost, compile_measure_kernels
from tracker.estimation.search.chamfer_kernels import measure_view
from tracker.evidence.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence, default_theta_px
from tracker.formats.model_toml import load_model

THETA = 15.0
FRONT = camera_at("front", (4.0, 0.0, 0.0))
BALL = at(solid((0.3, 0.3, 0.3)), 0, 0, 0)
CENTER = np.array([319.5, 239.5])
# The outline of a sphere at the middle of the image is a circle.
RADIUS_PX = 520 * np.tan(np.arcsin(0.3 / 4.0))

ROUNDING = 1e-7
"""What the sums of two kernels that do the same in single precision may differ by, as a share: compilers contract them
in other ways, depending on what was read from the cache."""

both_modes = pytest.mark.parametrize("outliers", ["truncated", "paper"])


def cost_of(points, distance, outliers, theta=THETA):
    """Cost of the ball before one camera with made-up evidence."""
    points = np.asarray(points, dtype=np.float32).reshape(-1, 2)
    view = ViewEvidence(FRONT, 1.0, points, distance.astype(np.float32))
    return ChamferCost([view], [BALL], theta, outliers)([BALL.values])


def ring(*distances_px):
    """Points around the ball's outline, each at a distance outside it."""
    a = 2 * np.pi * np.arange(len(distances_px)) / len(distances_px) + 0.1
    return CENTER + np.stack([np.cos(a), np.sin(a)], axis=1) * (RADIUS_PX + np.array(distances_px))[:, None]


def bands(shares, distances_px):
    """A distance image of upright bands that each cover a share of the ball's outline, from left to right."""
    # The share of a circle's arc left of x is 1 - acos(x/r)/pi.
    edges = CENTER[0] + RADIUS_PX * np.cos(np.pi * (1 - np.cumsum(shares)[:-1]))
    row = np.asarray(distances_px, dtype=float)[np.searchsorted(edges, np.arange(640))]
    return np.tile(row, (480, 1))


# The outline is known to 0.4 px at this size (see test_contours), and a piece of 4 px falls to one band whole.
BY_HAND = 0.25


def test_directed_and_undirected_by_hand():
    # GD96 Eq. 1-2: the mean distance of the points to the contour; Eq. 3: the mean of both directions.
    cost = cost_of(ring(2, 4, 6), bands([1], [3]), "truncated")
    assert cost.forward_px[0] == pytest.approx(3, abs=1e-5)
    assert cost.backward_px[0] == pytest.approx((2 + 4 + 6) / 3, abs=BY_HAND)
    assert cost.view_costs_px[0] == (cost.forward_px[0] + cost.backward_px[0]) / 2
    assert cost.total_px == cost.view_costs_px[0]


@pytest.mark.parametrize(
    ("shares", "distances", "truncated", "paper"),
    [
        ([0.5, 0.5], [2, 6], 4, 4),
        # Mean 2.1, standard deviation 3.3: beyond 8.7 px are outliers.
        ([0.9, 0.1], [1, 12], 0.9 * 1 + 0.1 * 12, 1),
        # Those beyond theta go first; the rest have no spread.
        ([0.6, 0.4], [1, 40], 0.6 * 1 + 0.4 * THETA, 1),
        # Then mean 2.375 and standard deviation 3.64 of what is within theta reject the 12 too, 70% are kept.
        ([0.7, 0.1, 0.2], [1, 12, 40], 0.7 + 1.2 + 0.2 * THETA, 1),
        # Fewer than half are kept.
        ([0.4, 0.6], [1, 40], 0.4 * 1 + 0.6 * THETA, THETA),
    ],
)
def test_outliers_by_hand(shares, distances, truncated, paper):
    for outliers, expected in (("truncated", truncated), ("paper", paper)):
        forward = cost_of(ring(1), bands(shares, distances), outliers).forward_px[0]
        assert forward == pytest.approx(expected, abs=BY_HAND), outliers
        # The same distances the other way round, as twenty points around the outline.
        counts = np.round(20 * np.array(shares)).astype(int)
        points = ring(*np.repeat(np.minimum(distances, 14.5), counts))
        if max(distances) < THETA:
            backward = cost_of(points, bands([1], [0]), outliers).backward_px[0]
            assert backward == pytest.approx(expected, abs=BY_HAND), outliers


@both_modes
def test_edges_far_from_the_prediction_have_no_say(outliers):
    near = ring(2, 2, 2, 2)
    far = CENTER + np.array([[RADIUS_PX + 20, 0], [0, -RADIUS_PX - 200], [0, 0]])
    alone = cost_of(near, bands([1], [0]), outliers)
    assert cost_of(np.concatenate([near, far]), bands([1], [0]), outliers).backward_px[0] == alone.backward_px[0]
    # The selection is that of the prediction, whatever pose is scored later.
    view = ViewEvidence(FRONT, 1.0, near.astype(np.float32), bands([1], [0]).astype(np.float32))
    moved = BALL.values + np.array([0, 0.1, 0, 0, 0, 0])
    later = ChamferCost([view], [BALL], THETA, outliers)([moved])
    assert later.backward_px[0] > alone.backward_px[0] + 3


def test_outside_the_image_the_way_to_the_border_counts():
    camera = camera_at("front", (4.0, 0.0, 0.0))
    distance = np.zeros((480, 640), np.float32)
    # The ball is at the right border: 0.3 m of 520 px at 4 m lie beyond it at y = 2.46 m.
    ball = at(BALL.model, 0, 2.46 + 0.15, 0)
    cost = ChamferCost([ViewEvidence(camera, 1.0, ring(0).astype(np.float32), distance)], [ball], 1e3)([ball.values])
    pieces = occluding_contours.trace([ball], camera).pieces_px
    middles, lengths = (pieces[:, :2] + pieces[:, 2:]) / 2, np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T)
    beyond = np.maximum(0, middles[:, 0] - 639)
    assert (beyond > 10).any()
    assert (beyond == 0).any()
    assert cost.forward_px[0] == pytest.approx(np.average(beyond, weights=lengths), rel=1e-4)


def test_own_contours_cost_next_to_nothing(gavrila):
    bodies = [PosedBody(gavrila, gavrila.neutral())]
    cost = ChamferCost(own_evidence(bodies, cameras_around()), bodies)([bodies[0].values])
    # Edges lie at whole pixels: a quarter of a pixel off on average.
    assert cost.total_px < 0.4


def test_view_without_edges_has_no_say(gavrila):
    values = gavrila.neutral()
    cameras = cameras_around(3)
    views = own_evidence([PosedBody(gavrila, values)], cameras)
    blind = view_evidence(cameras[1], np.zeros((480, 640), dtype=bool))
    moved = shaken(gavrila, values, np.random.default_rng(0), 0.2, 0.05)
    all_three = ChamferCost(views, [PosedBody(gavrila, values)])([moved])
    two = ChamferCost([views[0], blind, views[2]], [PosedBody(gavrila, values)])
    cost = two([moved])
    assert np.isnan(cost.view_costs_px).tolist() == [False, True, False]
    assert cost.view_costs_px[[0, 2]].tolist() == all_three.view_costs_px[[0, 2]].tolist()
    assert cost.total_px == pytest.approx(all_three.view_costs_px[[0, 2]].mean())
    total, by_view = two.of_person(0, moved[None], [moved])
    assert total[0] == pytest.approx(cost.total_px, rel=ROUNDING)
    np.testing.assert_allclose(by_view[0], cost.view_costs_px, rtol=ROUNDING)
    none = ChamferCost([blind], [PosedBody(gavrila, values)], THETA)
    assert none([moved]).total_px == THETA
    assert none.of_person(0, moved[None], [moved])[0].tolist() == [THETA]


@both_modes
def test_many_candidates_cost_the_same_as_one_by_one(gavrila, outliers):
    rng = np.random.default_rng(3)
    other = gavrila.with_height(1.6)
    poses = [gavrila.neutral(), other.retract(other.neutral(), np.eye(other.n_dofs)[1] * 0.5)]
    bodies = [PosedBody(gavrila, poses[0]), PosedBody(other, poses[1])]
    cost = ChamferCost(own_evidence(bodies, cameras_around()), bodies, outliers=outliers)
    for person, model in enumerate((gavrila, other)):
        candidates = np.stack([shaken(model, poses[person], rng, 0.2, 0.05) for _ in range(10)])
        totals, by_view = cost.of_person(person, candidates, poses)
        assert len(set(totals)) == 10
        for candidate, total, view_costs_px in zip(candidates, totals, by_view, strict=True):
            alone = cost([candidate if i == person else p for i, p in enumerate(poses)])
            assert alone.total_px == pytest.approx(total, rel=ROUNDING)
            np.testing.assert_allclose(alone.view_costs_px, view_costs_px, rtol=ROUNDING)


def test_costs_are_in_pixels_of_the_footage(gavrila):
    """The same scene at half the scale, matched edges and all, costs the same to what rounding leaves."""
    values = gavrila.neutral()
    cameras = cameras_around()
    moved = shaken(gavrila, values, np.random.default_rng(1), 0.1, 0.04)
    whole = ChamferCost(own_evidence([PosedBody(gavrila, values)], cameras), [PosedBody(gavrila, values)])([moved])
    half = tuple(
        ViewEvidence(v.camera, 0.5, v.points_px, v.distance)
        for v in own_evidence([PosedBody(gavrila, values)], [c.scaled(0.5) for c in cameras])
    )
    small = ChamferCost(half, [PosedBody(gavrila, values)])([moved])
    assert small.total_px == pytest.approx(whole.total_px, rel=0.05)


def away(cameras):
    """Directions and distances that lead off the evidence: sideways, up, down, out of the images, past the cameras."""
    to_camera = cameras[0].center_world / np.linalg.norm(cameras[0].center_world)
    directions = [*np.eye(3), *-np.eye(3), to_camera, -to_camera, (0.6, 0.8, 0), (-0.6, 0, 0.8)]
    return [np.array(d) * m for d in directions for m in (0.3, 0.6, 1.2, 2.5, 5.0, 20.0)]


@both_modes
@pytest.mark.parametrize("evidence", [pytest.param("own contours", marks=pytest.mark.slow), "real frame"])
def test_moving_off_the_evidence_never_lowers_the_cost(real_frame, outliers, evidence):
    model, values, views = real_frame
    if evidence == "own contours":
        views = own_evidence([PosedBody(model, values)], [v.camera for v in views])
    cost = ChamferCost(views, [PosedBody(model, values)], outliers=outliers)
    here = cost([values]).total_px
    theta = default_theta_px(views[0].camera.size)
    for move in away([v.camera for v in views]):
        moved = cost([moved_by(model, values, move)])
        assert here < moved.total_px <= theta + 1e-4, move


@both_modes
def test_wholly_off_costs_theta(real_frame, outliers):
    model, values, views = real_frame
    own = own_evidence([PosedBody(model, values)], [v.camera for v in views])
    cost = ChamferCost(own, [PosedBody(model, values)], 12.0, outliers)
    far = moved_by(model, values, (0.0, 0.0, 100.0))  # above every image
    assert cost([far]).view_costs_px.tolist() == [12.0] * 4
    # Predicted there, nothing of the scene is near: a direction without points costs theta too.
    predicted = ChamferCost(own, [PosedBody(model, far)], 12.0, outliers)
    assert predicted([far]).view_costs_px.tolist() == [12.0] * 4
    # Behind one camera it is gone from that view.
    behind = cost([moved_by(model, values, 2 * (views[2].camera.center_world - values[:3]))])
    assert behind.view_costs_px[2] == 12.0
    # Into a part of the images where there is nothing: the model's contour is seen whole, and explains nothing.
    left_of_all = [ViewEvidence(v.camera, 1.0, v.points_px - (300, 0), np.full_like(v.distance, 30.0)) for v in own]
    assert (
        ChamferCost(left_of_all, [PosedBody(model, values)], 12.0, outliers)([values]).forward_px.tolist() == [12.0] * 4
    )


def moved_by(model, values, step_m):
    return model.retract(values, np.pad(np.asarray(step_m), (0, model.n_dofs - 3)))


@both_modes
def test_a_limb_off_the_evidence_costs(real_frame, outliers):
    """One limb after the other leaves its own contour: the rest explains the scene less well each time."""
    model, values, views = real_frame
    own = own_evidence([PosedBody(model, values)], [v.camera for v in views])
    cost = ChamferCost(own, [PosedBody(model, values)], outliers=outliers)
    here = cost([values]).total_px
    for dof in ("left_shoulder.abduction", "right_shoulder.abduction", "left_hip.elevation", "right_hip.abduction"):
        for angle in (0.3, 0.6):
            step = np.where(np.array(model.dof_names) == dof, angle, 0.0)
            assert cost([model.retract(values, step)]).total_px > here + 0.05, (dof, angle)


@pytest.mark.parametrize("n_poses", [8, pytest.param(200, marks=pytest.mark.slow)])
def test_fast_cost_against_the_oracle(real_frame, n_poses):
    """Poses around the fitted one: each within 1% or 0.1 px of the slow, obvious cost.

    The two share no code but the shapes. The contour of the fast one runs inside the surface by up to 0.2 px (the
    chords of its grid, see test_contours), samples the distance image every 4 px rather than every 1.5, and decides on
    what is hidden piece by piece; the oracle's silhouettes are hulls of meshes six times as fine. A shift of the
    outline of 0.1 px on average moves a mean distance by no more than that; a part wrongly hidden or drawn, a view
    left out or a direction mistaken moves it by much more. Measured: 0.02 px on average, at most 0.05 px and 0.6%.
    """
    model, values, views = real_frame
    cost = ChamferCost(views, [PosedBody(model, values)])
    theta = default_theta_px(views[0].camera.size)
    scene = [near_contour(v, oracle.visible_contour(model, values, v.camera)[0], theta) for v in views]
    rng = np.random.default_rng(25)
    poses = [shaken(model, values, rng, np.radians(20), 0.08) for _ in range(n_poses)]
    fast = np.array([cost([p]).total_px for p in poses])
    slow = np.array([oracle.cost(model, p, views, scene, theta)[0] for p in poses])
    off = np.abs(fast - slow)
    assert np.ptp(slow) > 3  # the poses are good and bad
    assert np.all(off < np.maximum(0.1, 0.01 * slow)), (off.max(), (off / slow).max())
    # A search compares poses: the order of their costs must be the same.
    assert np.argmin(fast) == np.argmin(slow)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["gavrila22", "gavrila22_cones"])
def test_samples_twice_as_dense_say_the_same(real_frame, preset):
    """At 4 px between samples the cost is within 1% of that at 2 px, and the best candidate is the same."""
    _, values, views = real_frame
    model = load_model(preset, real_frame.model.height_m)
    cost = ChamferCost(views, [PosedBody(model, values)])
    rng = np.random.default_rng(8)
    candidates = np.stack([shaken(model, values, rng, np.radians(10), 0.05) for _ in range(300)])
    coarse = cost.of_person(0, candidates, [values])[0]
    # The length is compiled into the kernel: tracing by hand at half of it.
    fine = np.array([by_hand(cost, views, model, c, 2.0) for c in candidates])
    again = np.array([by_hand(cost, views, model, c, 4.0) for c in candidates[:60]])
    np.testing.assert_allclose(again, coarse[:60], rtol=2e-3)
    np.testing.assert_allclose(coarse, fine, rtol=0.01)
    assert np.argmin(coarse) == np.argmin(fine)


def by_hand(cost, views, model, values, piece_px):
    """The truncated cost from contours of pieces of any length."""
    total = []
    for view in range(len(views)):
        v, theta = views[view], default_theta_px(views[view].camera.size)
        contour = occluding_contours.trace([PosedBody(model, values)], v.camera, piece_px)
        pieces = contour.pieces_px[~contour.occluded]
        middles, lengths = (pieces[:, :2] + pieces[:, 2:]) / 2, np.linalg.norm(pieces[:, 2:] - pieces[:, :2], axis=1)
        inside = np.clip(middles, 0, np.array(v.camera.size) - 1)
        sampled = cv2.remap(v.distance, inside[None].astype(np.float32), None, cv2.INTER_LINEAR)[0]
        forward = np.minimum(sampled + np.linalg.norm(middles - inside, axis=1), theta)
        t = np.linspace(0, 1, 9)[:, None, None]
        along = (pieces[:, :2] + t * (pieces[:, 2:] - pieces[:, :2])).reshape(-1, 2)
        first = cost._arrays.firsts[view]
        scene = cost._arrays.points[:, first : first + cost._arrays.counts[view]].T
        backward = np.minimum(cKDTree(along).query(scene)[0], theta)
        total.append((np.average(forward, weights=lengths) + backward.mean()) / 2)
    return np.mean(total)


def near_contour(view, contour_px, theta):
    """Edge points within theta of a contour given as points 1.5 px apart."""
    return view.points_px[cKDTree(contour_px).query(view.points_px)[0] <= theta]


@both_modes
def test_the_cost_at_the_prediction_is_that_of_its_poses(gavrila, outliers):
    values = [posed(gavrila, 1), posed(gavrila, 2)]
    bodies = [PosedBody(gavrila, v) for v in values]
    cost = ChamferCost(own_evidence(bodies[:1], cameras_around()), bodies, outliers=outliers)
    found, expected = cost.at_prediction(), cost(values)
    assert found.total_px == pytest.approx(expected.total_px, rel=1e-6)
    np.testing.assert_allclose(found.forward_px, expected.forward_px, rtol=1e-5)
    np.testing.assert_allclose(found.backward_px, expected.backward_px, rtol=1e-5)
    for camera, pieces in zip(cameras_around(), cost.predicted_pieces_px, strict=True):
        contour = occluding_contours.trace(bodies, camera)
        np.testing.assert_allclose(pieces, contour.pieces_px[~contour.occluded], atol=1e-3)


def test_kernels_that_measure_are_compiled_apart_from_those_that_trace():
    """With the types with which a cost calls them: otherwise they are compiled twice."""
    view = ViewEvidence(FRONT, 1.0, ring(1, 2, 3).astype(np.float32), np.zeros((480, 640), np.float32))
    compile_measure_kernels([view], (BALL.model,))
    compiled = list(measure_view.signatures)
    for outliers in ("truncated", "paper"):
        ChamferCost([view], [BALL], THETA, outliers)([BALL.values])
    assert measure_view.signatures == compiled
    assert len(compiled) == 1
