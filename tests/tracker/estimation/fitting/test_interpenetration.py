import numpy as np
import pytest
from finite_differences import normal, slopes
from staging import at, posed, shaken, solid

from tracker.body.model import PosedBody
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.fitting.interpenetration import BodyPenetration, SelfPenetration

BALL, ROD = solid((0.1, 0.1, 0.1)), solid((0.05, 0.05, 0.3))


def embraced(gavrila, seed):
    """Two people with limbs and trunks partly within each other."""
    one, two = posed(gavrila, seed), posed(gavrila, seed + 1)
    two[:2] += 0.12, 0.05
    return [PosedBody(gavrila, one), PosedBody(gavrila, two)]


def test_a_body_within_another_is_pushed_out():
    bodies = [at(ROD, 0, 0, 0), at(ROD, 0.03, 0, 0)]
    fit = solve(ROD, bodies[1].values, [BodyPenetration(bodies, 1, 1.0), PosePrior(bodies[1].values, np.full(6, 1e-3))])
    assert fit.pose[0] > 0.05  # away from the other, who stands
    assert np.abs(fit.pose[1:]).max() < 1e-3
    assert fit.cost < 1e-3
    # The push between two people does not depend on who is fitted.
    pushes = [normal(BodyPenetration(bodies, i, 1.0), bodies[i]).gradient[:3] for i in (0, 1)]
    np.testing.assert_allclose(pushes[0], -pushes[1], atol=1e-9)
    assert pushes[1][0] < 0


def test_bodies_that_only_touch_are_left_alone():
    for x in (0.07, 0.2, 3.0):  # flesh gives way: two fifths of the radius
        bodies = [at(ROD, 0, 0, 0), at(ROD, x, 0, 0)]
        equations = normal(BodyPenetration(bodies, 0, 1.0), bodies[0])
        assert equations.cost == 0
        assert not equations.gradient.any()
        assert not equations.hessian.any()


def test_a_thin_part_within_a_thick_one_is_felt_from_both():
    """No point of the thick one's axis lies within the thin one, which misses it."""
    thick = solid((0.2, 0.2, 0.3))
    bodies = [at(thick, 0, 0, 0), at(ROD, 0.1, 0, 0, turns=(0, np.pi / 2, 0))]
    for i in (0, 1):
        assert normal(BodyPenetration(bodies, i, 1.0), bodies[i]).cost > 1


def test_the_weight_is_that_of_the_cost():
    bodies = [at(BALL, 0, 0, 0), at(BALL, 0.02, 0, 0)]
    once, thrice = (normal(BodyPenetration(bodies, 0, w), bodies[0]) for w in (1.0, 3.0))
    assert thrice.cost == pytest.approx(3 * once.cost)
    np.testing.assert_allclose(thrice.gradient, 3 * once.gradient, atol=1e-9)
    np.testing.assert_allclose(thrice.hessian, 3 * once.hessian, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("person", [0, 1])
def test_derivative_between_bodies(gavrila, seed, person):
    """The curvature of the other part's surface is neglected, so derivatives are right up to a small share."""
    bodies = embraced(gavrila, seed)
    block = BodyPenetration(bodies, person, 1.0)
    found, wanted = normal(block, bodies[person]), slopes(lambda b: normal(block, b).cost, bodies[person])
    assert found.cost > 1
    assert found.gradient @ wanted > 0.95 * np.linalg.norm(found.gradient) * np.linalg.norm(wanted)
    places = gavrila.dof_is_length
    np.testing.assert_allclose(found.gradient[places], wanted[places], rtol=0.25, atol=0.15 * np.abs(wanted).max())


def test_a_third_body_counts_too():
    bodies = [at(BALL, 0, 0, 0), at(BALL, 0.02, 0, 0), at(BALL, 0, 0.02, 0)]
    of_two = normal(BodyPenetration(bodies[:2], 0, 1.0), bodies[0]).cost
    assert normal(BodyPenetration(bodies, 0, 1.0), bodies[0]).cost == pytest.approx(2 * of_two)


def test_limbs_leave_the_trunk_and_stay_elsewhere(gavrila):
    """Arms pressed into the trunk come out; a body in its neutral pose costs nothing."""
    at_ease = gavrila.neutral()
    assert normal(SelfPenetration(), PosedBody(gavrila, at_ease)).cost == 0
    rng, worse = np.random.default_rng(2), 0
    for _ in range(20):
        values = shaken(gavrila, at_ease, rng, 0.5, 0.0)
        before = normal(SelfPenetration(), PosedBody(gavrila, values)).cost
        if before > 1:
            fit = solve(gavrila, values, [SelfPenetration(), PosePrior(values, np.full(gavrila.n_dofs, 1e-2))])
            assert normal(SelfPenetration(), PosedBody(gavrila, fit.pose)).cost < 0.1 * before
            worse += 1
    assert worse > 2
