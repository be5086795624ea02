"""Search of a leg that lies elsewhere, by contours and region evidence."""

from dataclasses import replace

import numpy as np
import pytest
from region_scenes import Walk, limb_of
from staging import SUIT

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.by_frame.limb_recovery import search_limbs
from tracker.estimation.by_frame.pose_score import FrameEvidence
from tracker.estimation.by_frame.settings import RecoverSettings
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.hypothesis import CLEAR_NATS, SAME_POSE_M
from tracker.estimation.runs.frame_hypotheses import FrameHypotheses
from tracker.estimation.runs.path_search import _limbs_to_search
from tracker.formats.model_toml import load_model

pytestmark = pytest.mark.slow  # its kernels are compiled for the benchmark alone

SETTINGS = replace(TrackSettings(), recover=RecoverSettings(proposals=256, n_local_search=12, n_limb_refined=4))


@pytest.fixture(scope="module")
def walk(gavrila):
    return Walk(gavrila, SUIT)


def searched(walk, k, bodies):
    """The refined pose, and the best one that a search of the leg finds."""
    evidence = FrameEvidence(walk.views[k], walk.known, walk.known.frame(walk.views[k], bodies))
    frame, pose = FrameHypotheses(evidence, bodies, 0, SETTINGS), bodies[0].values
    scorer = frame.limb_scorer(pose, frame.part_colors(pose))
    start = scorer.fitted(walk.model, pose)
    best, *_ = search_limbs(walk.model, [limb_of(walk.model, "right_calf")], start, (), scorer)
    return start, best


def off_m(walk, k, pose):
    """Largest distance of a point of the leg from the truth, metres."""
    points = np.isin(walk.model.point_parts, limb_of(walk.model, "right_calf").parts)
    true = walk.true[k][0].points_world
    return np.linalg.norm(walk.model.points_world(pose) - true, axis=1)[points].max()


def test_a_wrong_leg_is_found(walk):
    assert off_m(walk, 5, walk.tracked[5][0].values) > 2 * SAME_POSE_M
    start, best = searched(walk, 5, tuple(walk.tracked[5]))
    assert start.cost - best.cost > 10 * CLEAR_NATS
    assert off_m(walk, 5, best.pose) < SAME_POSE_M


def test_a_right_pose_stays(walk):
    """Although no prediction holds it."""
    tracked = PosedBody(walk.model, walk.model.retract(walk.true[3][0].values, np.full(walk.model.n_dofs, 0.002)))
    start, best = searched(walk, 3, (tracked,))
    assert best is start


def test_limbs_that_are_likelier_elsewhere_are_searched():
    """The likeliest first; not the head, which has no joints to search."""
    model = load_model("gavrila34")
    names = [x.name for x in limbs(model)]
    elsewhere = np.full(len(names), CLEAR_NATS)
    elsewhere[[names.index(n) for n in ("head", "left_calf", "right_forearm")]] += (9, 2, 5)
    assert [x.name for x in _limbs_to_search(model, elsewhere)] == ["right_forearm", "left_calf"]
