from dataclasses import replace

import numpy as np
import pytest
from staging import cameras_around, own_evidence, posed, shaken

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.fitting import gauss_newton, gauss_newton_compiled
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import PointTargets, PosePrior
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled, solve_compiled_or_plain
from tracker.estimation.fitting.interpenetration import BodyPenetration, SelfPenetration
from tracker.estimation.fitting.keypoints import KeypointBlock
from tracker.evidence.keypoints import ViewKeypoints
from tracker.formats.model_toml import load_model

CAMERAS = cameras_around(4)


INTO_THE_TRUNK = {
    "left_shoulder.abduction": -0.1, "left_shoulder.elevation": 0.0, "left_shoulder.twist": -1.57,
    "left_elbow.extension": 2.1,
}  # fmt: skip


class Staged:
    """Two people who reach into each other, one with an arm in the own trunk, and evidence of their true poses."""

    def __init__(self, model, seed):
        rng, self.model = np.random.default_rng(seed), model
        near, far = posed(model, seed), posed(model, seed + 50)
        far[:2] = near[:2] + np.array([0.15, 0.1])
        self.expected = shaken(model, near, rng, np.radians(8), 0.03)
        self.start = self.expected.copy()
        for name, angle in INTO_THE_TRUNK.items():
            self.start[model.dof_names.index(name)] = angle
        self.views = own_evidence([PosedBody(model, v) for v in (near, far)], CAMERAS)
        self.bodies = [PosedBody(model, self.start), PosedBody(model, far)]

    def blocks(self):
        model, n = self.model, self.model.n_dofs
        priors = [PosePrior(self.expected, np.full(n, 5.0)), PosePrior.of_spreads(model)]
        return [
            ContourResiduals(self.views, self.bodies),
            *priors,
            SelfPenetration(),
            BodyPenetration(self.bodies, 0, 1.0),
            self.keypoints(),
            PointTargets(
                np.arange(len(model.point_names)),
                model.points_world(self.expected),
                np.full(len(model.point_names), 20.0),
            ),
        ]

    def keypoints(self):
        """Every joint in every view, from 0 to 5 standard deviations off."""
        model, rng = self.model, np.random.default_rng(1)
        parts = model.proximal_parts
        places = rng.normal(0, 0.1, (len(parts), 3))
        T = PosedBody(model, self.start).kinematics.Ts_world_part[parts]
        world = np.einsum("nij,nj->ni", T[:, :3, :3], places) + T[:, :3, 3]
        off = np.linspace(0, 50, len(parts))[:, None] / np.sqrt(2)
        return KeypointBlock.of(
            [(c, ViewKeypoints(parts, places, c.project(world) + off, np.full(len(parts), 10.0))) for c in CAMERAS]
        )


def assert_same(found, expected):
    """Compare fits up to the rounding of single-precision sums in another order."""
    np.testing.assert_allclose(found.pose, expected.pose, atol=1e-6)
    assert found.cost == pytest.approx(expected.cost, rel=1e-6)
    assert found.iterations == expected.iterations
    np.testing.assert_allclose(found.hessian, expected.hessian, rtol=1e-5, atol=1e-5 * abs(expected.hessian).max())


@pytest.fixture(scope="module", params=["gavrila22", "gavrila38"])
def staged(request):
    return Staged(load_model(request.param), 4)


def both(staged, blocks, start=None, active_dofs=None, **how):
    """The fits of the compiled solver, without its fallback, and of the readable one."""
    start = staged.start if start is None else start
    expected = gauss_newton.solve(staged.model, start, blocks, active_dofs, **how)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(gauss_newton, "solve", None)
        return solve_compiled(staged.model, start, blocks, active_dofs, **how), expected


@pytest.mark.parametrize("n_blocks", [1, 2, 3, 4, 5, 6, 7])
def test_every_kind_of_block_counts(staged, n_blocks):
    """At one pose: each adds what it adds by itself."""
    blocks = staged.blocks()
    found, expected = both(staged, blocks[:n_blocks], max_iterations=0)
    assert_same(found, expected)
    last = blocks[n_blocks - 1].linearize(staged.model, staged.start, staged.model.kinematics(staged.start))
    assert last.cost > 0.1 or np.isinf(staged.model.spreads).all()


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"tolerance": 0.02}, {"gain": 5.0}])
def test_every_step_is_that_of_the_readable_version(staged, how):
    """Step by step: costs of images are rough, so after a dozen steps rounding may lead elsewhere."""
    values, costs = staged.start, []
    for _ in range(8):
        found, expected = both(staged, staged.blocks(), values, max_iterations=1, **how)
        assert_same(found, expected)
        values = expected.pose
        costs.append(expected.cost)
    assert costs[2] < costs[1] < costs[0]


@pytest.mark.parametrize(
    "how", [*({"tolerance": t} for t in (0.0, 0.2, 9.0)), *({"gain": g} for g in (5.0, 15.0, 25.0, 40.0))]
)
def test_a_descent_ends_as_that_of_the_readable_version(staged, how):
    assert_same(*both(staged, staged.blocks(), max_iterations=4, **how))


class Asked:
    """A block without residuals that counts its calls."""

    def __init__(self):
        self.times = 0

    def linearize(self, model, values, kinematics):
        self.times += 1
        return gauss_newton.NormalEquations(0.0, np.zeros(model.n_dofs), np.zeros((model.n_dofs, model.n_dofs)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("how", [{}, {"tolerance": 1e-3}, {"gain": 1.0}, {"gain": 10.0}])
def test_whole_descents_without_images_are_the_same(staged, seed, how):
    """From within another body: all of it in double precision, so that dozens of steps, many refused, end alike."""
    model, n, asked = staged.model, staged.model.n_dofs, Asked()
    other = shaken(model, staged.start, np.random.default_rng(seed), 0.05, 0.03)
    deep = [PosedBody(model, staged.start), PosedBody(model, other)]
    blank = [replace(v, points_px=v.points_px[:0], normals=v.normals[:0]) for v in staged.views]
    match, prior = ContourResiduals(blank, deep), PosePrior(staged.expected, np.full(n, 2.0))
    blocks = [match, prior, SelfPenetration(), BodyPenetration(deep, 0, 1.0)]
    expected = gauss_newton.solve(model, staged.start, [*blocks, asked], **how)
    found = solve_compiled(model, staged.start, blocks, **how)
    assert expected.iterations > 1
    assert how.get("gain") or asked.times > expected.iterations + 3
    np.testing.assert_allclose(found.pose, expected.pose, atol=1e-10)
    assert (found.iterations, found.cost) == (expected.iterations, pytest.approx(expected.cost, rel=1e-9))


def test_limits_hold_and_what_may_not_move_stays(staged):
    """Degrees of freedom drawn beyond their limits end at them; inactive ones outside their limits stay there."""
    start, wanted, model = staged.start.copy(), staged.expected.copy(), staged.model
    low, high, fixed = (model.dof_names.index(f"{n}.extension") for n in ("right_knee", "right_elbow", "left_knee"))
    start[low], wanted[low] = model.limits[low, 0], model.limits[low, 0] - 2
    start[high], wanted[high] = model.limits[high, 1], model.limits[high, 1] + 2
    start[fixed] = model.limits[fixed, 0] - 0.3
    blocks = [*staged.blocks(), PosePrior(wanted, np.full(model.n_dofs, 100.0))]
    found, expected = both(staged, blocks, start, np.arange(model.n_dofs) != fixed, max_iterations=3)
    assert_same(found, expected)
    assert (found.pose[low], found.pose[high]) == (model.limits[low, 0], model.limits[high, 1])
    assert found.pose[fixed] == start[fixed]


def test_a_limb_alone(staged):
    limb = next(x for x in limbs(staged.model) if x.name == "left_forearm")
    match, *others = staged.blocks()
    found, expected = both(staged, [match.restricted_to(limb.parts), *others], active_dofs=limb.dofs, max_iterations=3)
    assert_same(found, expected)
    np.testing.assert_array_equal(found.pose[~limb.dofs], staged.start[~limb.dofs])


def test_known_points_without_views(staged):
    blocks = staged.blocks()
    for centers in (False, True):
        assert_same(*both(staged, [blocks[1], replace(blocks[-1], centers=centers)]))


def test_points_that_nothing_holds(staged):
    """Views without evidence: no step is worth taking, and no matrix is definite."""
    blank = [replace(v, points_px=v.points_px[:0], normals=v.normals[:0]) for v in staged.views]
    found, expected = both(staged, [ContourResiduals(blank, staged.bodies)])
    assert_same(found, expected)
    assert found.cost == 0.0


@pytest.mark.parametrize("n", [1, 2, 5])
def test_steps_are_those_of_the_readable_version(n):
    """Of some degrees of freedom; and against the gradient where the matrix is not definite."""
    rng = np.random.default_rng(n)
    J, g, moving, step = rng.normal(size=(20, 6)), rng.normal(size=6), np.arange(n), np.empty(6)
    for H in (J.T @ J, -J.T @ J):
        own = H[:n, :n]
        damping = 0.1 * (np.diag(own) + 1e-6 * max(1e-12, np.trace(own) / n))
        expected = gauss_newton.damped_step(own, g[:n], damping)
        promised = gauss_newton_compiled._damped_step(g, H, moving, 0.1, np.empty((6, 6)), step)
        np.testing.assert_allclose(step[:n], expected, rtol=1e-9)
        assert promised == pytest.approx(-(g[:n] + 0.5 * own @ expected) @ expected)


@pytest.mark.parametrize(
    ("strange", "named"),
    [
        ("two matches", "found 2 ContourResiduals"), ("another block", "found Asked"),
        ("a ball joint", "found the ball joint 'left_shoulder'"),
    ],
)  # fmt: skip
def test_uncovered_cases_are_refused_by_name(staged, strange, named):
    model, blocks = staged.model, staged.blocks()
    if strange == "two matches":
        blocks.append(blocks[0])
    elif strange == "another block":
        blocks.append(Asked())
    else:
        shoulder = next(i for i, j in enumerate(model.joints) if j.name == "left_shoulder")
        joints = list(model.joints)
        joints[shoulder] = replace(joints[shoulder], kind="ball", axes=())
        model = replace(model, joints=tuple(joints))
        assert solve_compiled_or_plain(model, model.neutral(), [PosePrior.of_spreads(model)]).cost == 0
    with pytest.raises(TypeError, match=named):
        solve_compiled(model, model.neutral(), blocks)
