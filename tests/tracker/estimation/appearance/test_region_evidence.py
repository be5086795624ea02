"""Region evidence: learnt from a figure in its clothes, whose limbs are wrong on some frames."""

import numpy as np
import pytest
from region_scenes import WALL, Walk, limb_of
from staging import SUIT

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.part_drawing import CELL_PX, cells_of, draw_bodies
from tracker.estimation.appearance.region_limb_scorer import RegionLimbScorer
from tracker.estimation.appearance.region_model import SAMPLE_M, elsewhere_nats, isotonic, worst_parts
from tracker.evidence.contours.label_image import part_labels
from tracker.evidence.images.color_histogram import BINS

pytestmark = pytest.mark.slow  # its kernels are compiled for the benchmark alone


@pytest.fixture(scope="module")
def run(gavrila):
    return Walk(gavrila, SUIT)


def plain_score(known, frame, bodies):
    """Nats and samples of each part in each view, by their definition, from the labels of another renderer."""
    nats, samples = np.zeros((2, *known.tables.trust.shape[:2]))
    for i, view in enumerate(frame.views):
        labels = part_labels(bodies, view.camera)
        nearness = draw_bodies(bodies, [view])[0].nearness
        for v, u in np.argwhere((labels > 0) & (nearness > 0)):
            p = labels[v, u] - 1
            r, g, b = view.colors[v, u].astype(int) * BINS // 256
            color = (r * BINS + g) * BINS + b
            log_part, log_rest, trust = (table[i, p] for table in known.tables)
            ratio = log_part[color] - max(log_rest[color], frame.background[i][v, u])
            side_m = 1 / (view.camera.K[0, 0] * nearness[v, u])
            samples[i, p] += (side_m / SAMPLE_M) ** 2
            nats[i, p] += (side_m / SAMPLE_M) ** 2 * trust[int(np.clip(np.floor(ratio / 0.5) + 24, 0, 47))]
    return nats, samples


def test_a_score_is_what_its_definition_says(run):
    frame = run.known.frame(run.views[3], run.true[3])
    found = run.known.score(frame, run.true[3])
    nats, samples = plain_score(run.known, frame, run.true[3])
    assert found.nats.sum() > 100
    np.testing.assert_allclose(found.samples, samples, atol=0.6)
    np.testing.assert_allclose(found.nats, nats, atol=2.0)
    assert run.known.nats(frame, run.true[3]) == pytest.approx(found.nats.sum())


def test_cells_lie_where_the_pixels_of_the_view_do(run):
    """Regions with odd borders: each cell has the colours and the rays of its four pixels."""
    view = run.views[0][1]
    cells = cells_of(view)
    assert cells.corner == (17, 3)
    u0, v0 = 2 * cells.corner[0] - view.corner_px[0], 2 * cells.corner[1] - view.corner_px[1]
    block = view.colors[v0 + 20 : v0 + 22, u0 + 30 : u0 + 32].reshape(4, 3)
    np.testing.assert_allclose(cells.colors[10, 15], block.mean(axis=0), atol=0.6)
    point = np.array([[0.1, 0.2, 0.3]])
    expected = (view.camera.project(point) - (u0, v0) + 0.5) / CELL_PX - 0.5
    np.testing.assert_allclose(cells.camera.project(point), expected, atol=1e-9)


def test_a_limb_scorer_is_a_score_of_all_parts(run):
    """Poses that differ in a limb: the sums differ as those of whole bodies, also where the limb is hidden."""
    model, pose = run.model, run.true[5][0].values
    frame, rng = run.known.frame(run.views[5], run.true[5]), np.random.default_rng(1)
    for name in ("left_forearm", "right_calf"):
        limb = limb_of(model, name)
        poses = np.array(
            [model.clip(model.retract(pose, rng.normal(0, 0.6, model.n_dofs) * limb.dofs)) for _ in range(9)]
        )
        scorer = RegionLimbScorer(run.known, frame, run.true[5], 0, limb.parts)
        whole = [run.known.nats(frame, [PosedBody(model, p)]) for p in poses]
        np.testing.assert_allclose(scorer(poses) + scorer.static_nats, whole, atol=1e-3)
        assert np.std(whole) > 5
        assert scorer(pose[None])[0] > scorer(poses).max()


def test_limbs_that_are_wrong_are_likelier_elsewhere(run):
    """Although they were learnt from; the other limbs are not."""
    elsewhere = elsewhere_nats(
        np.array([run.score(k, b).nats.sum(axis=0) for k, b in enumerate(run.tracked)]), [run.model]
    )
    nats = np.take_along_axis(elsewhere, worst_parts(elsewhere, [run.model]), axis=1)
    names = [x.name for x in limbs(run.model)]
    leg = nats[:, names.index("right_calf")]
    assert leg[run.wrong].min() > 10 > 5 > leg[~run.wrong].max()
    assert nats[:, names.index("left_forearm")].max() < 5


def test_clothes_like_the_wall_are_not_trusted(gavrila, run):
    """Legs in the colour of the wall have no evidence, without any rule; the rest keeps its own."""
    dull = Walk(gavrila, SUIT | dict.fromkeys(("thigh", "calf"), WALL))
    calf, torso = (gavrila.part_index[n] for n in ("left_calf", "torso"))
    rates = []
    for each in (dull, run):
        found = each.score(3, each.true[3])
        rates.append(found.nats.sum(axis=0) / found.samples.sum(axis=0))
    assert abs(rates[0][calf]) < 0.5
    assert rates[0][torso] > 1.5
    assert rates[1][calf] > 1.5


def test_isotonic():
    values = isotonic(np.array([1.0, 3.0, 1.0, 5.0, 4.0]), np.array([1.0, 1.0, 3.0, 1.0, 1.0]))
    np.testing.assert_allclose(values, [1.0, 1.5, 1.5, 4.5, 4.5])
