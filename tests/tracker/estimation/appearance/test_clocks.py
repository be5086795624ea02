"""Colours and region evidence under a body in a view whose picture was taken later than the frame."""

from dataclasses import replace

import numpy as np
import pytest
from region_scenes import Walk, limb_of
from staging import SUIT, cameras_around, dressed, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.appearance.region_limb_scorer import RegionLimbScorer

AHEAD = 0.5


@pytest.fixture(scope="module")
def body(gavrila):
    velocity = np.where(gavrila.dof_is_length, 0.06, 0.12) * np.sign(np.sin(np.arange(gavrila.n_dofs)))
    return PosedBody(gavrila, posed(gavrila, 1), velocity)


@pytest.fixture(scope="module")
def views(body):
    """A view of the frame, and a later one."""
    first, second = cameras_around(2)
    (late,) = dressed([body.ahead(AHEAD)], [second], SUIT)
    return (*dressed([body], [first], SUIT), replace(late, ahead_frames=AHEAD))


def test_colors_are_sampled_where_the_body_is_then(body, views):
    on_time, late = views[0], replace(views[1], ahead_frames=0.0)
    then = body.ahead(AHEAD)
    known = Colors(views, [body]).learn()
    found = Colors(views, [body]).score(body.values, known)
    expected = [Colors([on_time], [body]).score(body.values, known), Colors([late], [then]).score(then.values, known)]
    assert found.nats == pytest.approx(sum(e.nats for e in expected))
    assert Colors(views, [body]).nats(body.values[None], known)[0] == pytest.approx(found.nats)
    still = PosedBody(body.model, body.values)
    assert found.nats > Colors(views, [still]).score(body.values, known).nats + 10


def test_a_limb_is_scored_where_it_is_then(gavrila, body, views):
    on_time, late = views[0], replace(views[1], ahead_frames=0.0)
    limb, then = next(x for x in limbs(gavrila) if x.name == "left_forearm"), body.ahead(AHEAD)
    steps = np.random.default_rng(0).normal(0, 0.3, (5, gavrila.n_dofs)) * limb.dofs
    poses = np.array([gavrila.retract(body.values, s) for s in steps])
    known = Colors(views, [body]).learn()
    found = Colors(views, [body]).limb_scorer(body.values, limb.parts, known)(poses)
    expected = Colors([on_time], [body]).limb_scorer(body.values, limb.parts, known)(poses)
    expected += Colors([late], [then]).limb_scorer(then.values, limb.parts, known)(body.poses_ahead(poses, AHEAD))
    np.testing.assert_allclose(found, expected)


def test_region_evidence_is_drawn_where_the_body_is_then(gavrila):
    """A walk whose pictures are half a frame early by the clock: poses half a frame later then fit."""
    run, limb = Walk(gavrila, SUIT), limb_of(gavrila, "left_forearm")
    velocity = np.where(gavrila.dof_is_length, 0.06, 0.12) * np.sign(np.sin(np.arange(gavrila.n_dofs)))
    true = run.true[5][0]
    later = PosedBody(gavrila, gavrila.retract(true.values, AHEAD * velocity), velocity)
    views = tuple(replace(v, ahead_frames=-AHEAD) for v in run.views[5])
    frame = run.known.frame(views, [later])
    found = run.known.score(frame, [later]).nats
    back = later.ahead(-AHEAD)
    on_time = run.known.frame(run.views[5], [back])
    np.testing.assert_allclose(found, run.known.score(on_time, [back]).nats, atol=1e-3)
    scorer = RegionLimbScorer(run.known, frame, [later], 0, limb.parts)
    expected = RegionLimbScorer(run.known, on_time, [back], 0, limb.parts)
    assert scorer.static_nats == pytest.approx(expected.static_nats, abs=1e-3)
    np.testing.assert_allclose(scorer(later.values[None]), expected(back.values[None]), atol=1e-3)
