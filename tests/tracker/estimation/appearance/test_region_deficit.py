"""How much likelier limbs are elsewhere, by made-up evidence of their parts."""

import numpy as np

from tracker.body.limbs import limbs
from tracker.estimation.appearance.region_model import elsewhere_nats, worst_parts, worst_views


def evidence(model, n=40, usual=50.0, spread=5.0):
    """Evidence of all parts, (n, P), normal around the usual."""
    return np.random.default_rng(0).normal(usual, spread, (n, len(model.parts)))


def of_limb(model, nats, name):
    elsewhere = elsewhere_nats(nats, [model])
    of_limbs = np.take_along_axis(elsewhere, worst_parts(elsewhere, [model]), axis=1)
    return of_limbs[:, [x.name for x in limbs(model)].index(name)]


def test_a_limb_without_its_usual_evidence_is_elsewhere(gavrila):
    nats, calf = evidence(gavrila), gavrila.part_index["left_calf"]
    nats[7, calf] = 2.0
    found = of_limb(gavrila, nats, "left_calf")
    assert found[7] > 10
    assert np.delete(found, 7).max() < 0
    assert of_limb(gavrila, nats, "right_calf").max() < 0


def test_rare_or_camouflaged_parts_weigh_little(gavrila):
    calf, forearm = (gavrila.part_index[n] for n in ("left_calf", "left_forearm"))
    twins = [gavrila.part_index[n] for n in ("right_calf", "right_forearm")]
    dull, hidden = evidence(gavrila), evidence(gavrila)
    dull[:, [calf, twins[0]]] = np.random.default_rng(1).normal(1.5, 1.0, (40, 2))
    dull[7, calf] = 0.0
    assert of_limb(gavrila, dull, "left_calf").max() < 3
    hidden[:, [forearm, twins[1]]] = np.random.default_rng(2).uniform(
        0, 60, (40, 2)
    )  # behind the trunk, half of the time
    hidden[7, forearm] = 2.0
    assert of_limb(gavrila, hidden, "left_forearm")[7] < 3


def test_a_limb_lost_in_most_frames_is_measured_by_its_counterpart(gavrila):
    nats, calf = evidence(gavrila), gavrila.part_index["left_calf"]
    nats[1:, calf] = 2.0
    assert of_limb(gavrila, nats, "left_calf")[1:].min() > 10
    assert of_limb(gavrila, nats, "left_calf")[0] < 0 > of_limb(gavrila, nats, "right_calf").max()


def test_the_part_and_the_view_that_lack_most_are_named(gavrila):
    """Of several people."""
    models, calf = [gavrila, gavrila], len(gavrila.parts) + gavrila.part_index["left_calf"]
    nats = np.stack([np.hstack([evidence(m, spread=2.0) for m in models]) for _ in range(3)], axis=1)
    nats[7, 1, calf] = 0.0
    parts = worst_parts(elsewhere_nats(nats.sum(axis=1), models), models)
    limb = len(limbs(gavrila)) + [x.name for x in limbs(gavrila)].index("left_calf")
    assert parts[7, limb] == calf
    assert worst_views(nats, models)[7, calf] == 1
