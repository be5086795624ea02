import numpy as np
import pytest
from staging import SUIT, cameras_around, dressed, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.by_frame.frame_problem import FrameProblem, PersonPrior, prior_blocks
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import OWN_TRUST, RecoverSettings
from tracker.estimation.by_frame.start_pose import _normal_samples, _samples, search_along_covariance
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import solve
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.formats.model_toml import load_model

TURNED = ("torso", "waist", "spine", "left_hip", "right_hip")


@pytest.fixture(scope="module")
def model():
    return load_model("gavrila34")


def turned_trunk(model, truth, seed):
    """A pose with trunk and hips turned at random, some 11 degrees in each angle; the legs follow."""
    turns = np.array([n.startswith(TURNED) for n in model.dof_names]) & ~model.dof_is_length
    step = np.zeros(model.n_dofs)
    step[turns] = np.random.default_rng(seed).normal(0, 0.2, turns.sum())
    return model.clip(model.retract(truth, step))


class Staged:
    """A frame that shows a body, and the refined pose that a tracker would have found from a wrong one."""

    def __init__(self, model, truth, wrong, active_dofs=None):
        bodies, settings = [PosedBody(model, truth)], TrackSettings()
        views = dressed(bodies, cameras_around(4), SUIT)
        self.model, self.truth = model, truth
        self.sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)
        match = ContourResiduals(views, [PosedBody(model, wrong)])
        priors = prior_blocks(model, wrong, OWN_TRUST * self.sigma)
        colors = Colors(views, [PosedBody(model, wrong)])
        self.scorer = PoseScorer.of(match, priors, colors, None, RecoverSettings(), active_dofs)
        fit = solve(model, wrong, [match, *priors], active_dofs, max_iterations=15, tolerance=1e-3)
        self.here = self.scorer.scored(model, fit)

    def search(self):
        return search_along_covariance(self.model, self.here, self.scorer, self.sigma)[0]

    def contour_cost(self, fit):
        return float(self.scorer.residuals.costs(fit.pose[None])[0])

    def off_m(self, fit):
        found, true = self.model.points_world(fit.pose), self.model.points_world(self.truth)
        return np.linalg.norm(found - true, axis=1).max()


@pytest.mark.slow
def test_trunks_that_turned_the_wrong_way_are_found_again(model):
    """Refinement does not lead out of these poses, and no single limb of them is lost."""
    n_nearer = 0
    for seed in (0, 1, 2, 6, 7):
        truth = posed(model, seed)
        staged = Staged(model, truth, turned_trunk(model, truth, seed))
        assert staged.off_m(staged.here) > 0.1
        result = staged.search()
        assert staged.contour_cost(result) < staged.contour_cost(staged.here) - CLEAR_NATS
        n_nearer += staged.off_m(result) < 0.6 * staged.off_m(staged.here)
    assert n_nearer >= 3


def test_samples_keep_locked_angles_and_are_the_same_each_time(model):
    truth = posed(model, 0)
    active = ~np.array([n.startswith(("left_shoulder", "left_elbow")) for n in model.dof_names])
    staged = Staged(model, truth, turned_trunk(model, truth, 0), active)
    samples = np.array(_samples(model, staged.here.pose, staged.scorer, OWN_TRUST * staged.sigma))
    assert np.abs(samples - staged.here.pose).max(axis=0)[active].min() > 0.001
    np.testing.assert_array_equal(samples[:, ~active], np.repeat(staged.here.pose[None, ~active], len(samples), axis=0))
    _normal_samples.cache_clear()
    np.testing.assert_array_equal(_samples(model, staged.here.pose, staged.scorer, OWN_TRUST * staged.sigma), samples)
    another = np.array(_samples(model, staged.here.pose, staged.scorer, OWN_TRUST * staged.sigma, draw=1))
    assert np.abs(another - samples).max() > 0.01


def test_a_fit_is_drawn_on_from_a_wrong_prediction(model):
    """The prediction holds the first refinement back; without it the contours pull farther."""
    truth, settings = posed(model, 1), TrackSettings(trust_rad=0.03)
    step = np.zeros(model.n_dofs)
    step[model.dof_names.index("left_shoulder.abduction")] = 0.25
    predicted = model.clip(model.retract(truth, step))
    views = dressed([PosedBody(model, truth)], cameras_around(4), SUIT)
    problem = FrameProblem(views, [PersonPrior(model, predicted)], settings)
    first = problem.refine(0, (PosedBody(model, predicted),))
    found = problem.converge(0, first)

    def cost(fit):
        return float(fit.residuals.costs(fit.fit.pose[None])[0])

    assert cost(found) < cost(first) - 1.0
    assert found.assessment is None
    np.testing.assert_array_equal(found.body.values, found.fit.pose)


def test_a_freed_fit_does_not_depend_on_which_limbs_are_trusted(model):
    truth = posed(model, 1)
    problem = FrameProblem(
        dressed([PosedBody(model, truth)], cameras_around(4), SUIT), [PersonPrior(model, truth)], TrackSettings()
    )
    found = problem.refine(0, (PosedBody(model, truth),))
    untrusted = (limbs(model)[1],)
    blocks = [found.residuals, *problem.priors(0, found.bodies, untrusted)]
    weaker = found._replace(fit=problem.solve(0, found.fit.pose, blocks, 0), untrusted_limbs=untrusted)
    assert not np.allclose(weaker.fit.hessian, found.fit.hessian)
    np.testing.assert_allclose(problem.freed(0, weaker).hessian, problem.freed(0, found).hessian, atol=1e-6)
