import numpy as np
import pytest
from contour_oracle import MatchOracle, without_ties
from finite_differences import normal
from staging import cameras_around, own_evidence, posed, shaken

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.fitting.contour_residuals import ContourResiduals, MatchSettings
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.occluding_contours import contour_room, part_poses
from tracker.evidence.contours.pieces import PIECE_PX, piece_buffer, place_parts, static_contours_buffer
from tracker.evidence.contours.static_cache import (
    copy_poses,
    is_static_unchanged,
    store_pieces,
    trace_moving_parts,
    trace_static,
)
from tracker.evidence.contours.surfaces import surfaces_of

CAMERAS = cameras_around()
THETA = 20.0
N_PEOPLE = 2


def couple(gavrila, seed=0):
    """Two people close together, facing each other."""
    near, far = posed(gavrila, seed), posed(gavrila, seed + 50)
    step = np.zeros(gavrila.n_dofs)
    step[:2] = far[:2] - near[:2]
    near = gavrila.retract(near, step)
    step[:2] = 0.15, 0.1
    return [PosedBody(gavrila, gavrila.retract(near, step)), PosedBody(gavrila, far)]


def with_limb_shaken(body, limb, rng, sigma_rad=0.6):
    step = np.where(limb.dofs, rng.normal(0.0, sigma_rad, body.model.n_dofs), 0.0)
    return PosedBody(body.model, body.model.clip(body.model.retract(body.values, step)))


def traced_with_kept(bodies, then, moves):
    """Contours of some people in each view: moving parts are traced, static parts come from the cache of another
    pose."""
    surfaces = surfaces_of(tuple(b.model for b in bodies))
    room = contour_room(CAMERAS[:1], len(bodies))
    out, static = piece_buffer(surfaces, room), static_contours_buffer(len(CAMERAS), room, 1, moves)
    views = [(i, c.projection, c.center_world) for i, c in enumerate(CAMERAS)]
    place_parts(part_poses(bodies), surfaces, out)
    for i, P, eye in views:
        trace_static(P, eye, surfaces, PIECE_PX, static, out)
        store_pieces(i, out, static)
    copy_poses(part_poses(bodies), static.Ts)
    assert is_static_unchanged(part_poses(then), moves, static.Ts)
    place_parts(part_poses(then), surfaces, out)
    for i, P, eye in views:
        n = trace_moving_parts(i, P, eye, surfaces, PIECE_PX, static, out)
        yield out.ends[:, :n].T.copy(), out.occluded[:n].copy(), np.repeat(np.arange(len(moves)), np.diff(out.firsts))


@pytest.mark.parametrize("seed", range(4))
def test_pieces_of_a_limb_that_moves_among_kept_ones_are_those_of_a_trace_of_everybody(gavrila, seed):
    """A limb swings through its own body and another one: what it covered is visible again, what it covers is
    occluded."""
    bodies, rng, changed = couple(gavrila, seed), np.random.default_rng(seed), 0
    for limb in limbs(gavrila):
        then = [with_limb_shaken(bodies[0], limb, rng), bodies[1]]
        moves = np.zeros(N_PEOPLE * len(gavrila.parts), bool)
        moves[limb.parts] = True
        for camera, (pieces, occluded, parts) in zip(CAMERAS, traced_with_kept(bodies, then, moves), strict=True):
            expected, before = (occluding_contours.trace(b, camera) for b in (then, bodies))
            np.testing.assert_array_equal(parts, expected.parts)
            np.testing.assert_allclose(pieces, expected.pieces_px, atol=1e-3)
            assert np.count_nonzero(occluded != expected.occluded) <= 1  # one that grazes, by rounding
            unmoved = ~np.isin(parts, limb.parts)
            changed += np.count_nonzero(occluded[unmoved] != before.occluded[~np.isin(before.parts, limb.parts)])
    assert changed > 50


@pytest.fixture(scope="module")
def staged(gavrila):
    bodies = couple(gavrila, 3)
    settings = MatchSettings()
    views = own_evidence(bodies, CAMERAS)
    rng = np.random.default_rng(7)
    start = [PosedBody(gavrila, shaken(gavrila, b.values, rng, np.radians(4), 0.02)) for b in bodies]
    return without_ties(views, start, settings, THETA), start, settings


def afresh(staged, bodies, person=0):
    views, _, settings = staged
    return ContourResiduals(views, bodies, person, settings, THETA, everywhere=True)


@pytest.mark.slow
@pytest.mark.parametrize("person", range(N_PEOPLE))
def test_pose_after_pose_costs_what_each_costs_by_itself(gavrila, staged, person):
    views, start, settings = staged
    match, rng = afresh(staged, start, person), np.random.default_rng(1)
    for _ in range(6):
        moved = PosedBody(gavrila, shaken(gavrila, start[person].values, rng, 0.2, 0.05))
        bodies = [moved if i == person else b for i, b in enumerate(start)]
        found, oracle = normal(match, moved), MatchOracle(views, bodies, person, settings, THETA)
        assert found.cost == pytest.approx(oracle.cost(moved.values), rel=1e-4)
        alone = normal(afresh(staged, bodies, person), moved)
        np.testing.assert_allclose(found.gradient, alone.gradient, rtol=1e-6, atol=1e-6 * abs(alone.gradient).max())


def test_a_match_of_a_limb_is_that_of_the_body_as_far_as_the_limb_goes(gavrila, staged):
    """Also after the rest has moved: the static parts are then cached again."""
    start, rng = staged[1], np.random.default_rng(2)
    whole = afresh(staged, start)
    for limb in limbs(gavrila):
        of_limb, body = whole.restricted_to(limb.parts), start[0]
        for _ in range(3):
            for _ in range(3):
                moved = with_limb_shaken(body, limb, rng, 0.3)
                expected, found = normal(whole, moved), normal(of_limb, moved)
                scale = abs(expected.gradient).max(), abs(expected.hessian).max()
                assert found.cost == pytest.approx(expected.cost, rel=1e-5)
                assert of_limb.costs(moved.values[None])[0] == pytest.approx(expected.cost, rel=1e-5)
                off = found.gradient[limb.dofs] - expected.gradient[limb.dofs]
                np.testing.assert_allclose(off / scale[0], 0.0, atol=1e-4)
                off = (found.hessian - expected.hessian)[np.ix_(limb.dofs, limb.dofs)]
                np.testing.assert_allclose(off / scale[1], 0.0, atol=1e-4)
            body = PosedBody(gavrila, shaken(gavrila, body.values, rng, 0.05, 0.02))
