"""Find poses of a person that are about as good as a given one, or better, and compare them in nats."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.region_model import RegionModel
from tracker.body.limbs import Limb, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.observer import Observer
from tracker.fitting.hypothesis import SAME_POSE_M, Hypothesis, distance_m, distinct
from tracker.geometry.arrays import Array
from tracker.tracking.estimation.frame_problem import Bodies, with_body
from tracker.tracking.estimation.limb_repair import MIN_GAIN_NATS, FrameEvidence, better_limbs, limbs_to_search
from tracker.tracking.estimation.part_evidence import PartTable
from tracker.tracking.estimation.pose_score import common_evidence, scorer_without_prediction
from tracker.tracking.estimation.settings import EstimationSettings


def limbs_in_doubt(model: BodyModel, table: PartTable) -> list[Limb]:
    """Return the limbs of a pose to search by its table, the likeliest elsewhere first."""
    return limbs_to_search(model, np.array([table.elsewhere[limb.parts].max() for limb in limbs(model)]))


class Tried(NamedTuple):
    """The poses of a person in which alternatives are sought."""

    stored: Sequence[Array]
    """Known alternatives, (n_values,) each."""
    limbs: Sequence[Limb] = ()
    """Limbs to search for more."""
    around: Sequence[Array] = ()
    """Poses whose limbs are tried as they are, such as those of the frames around, (n_values,) each."""
    active_dofs: NDArray[np.bool_] | None = None
    """Degrees of freedom that may move, (n_dofs,); None: all. Stored poses stay as they are."""


def alternative_poses(
    known: RegionModel, observer: Observer, frame: int, bodies: Bodies, person: int, settings: EstimationSettings,
    tried: Tried,
) -> list[Hypothesis]:  # fmt: skip
    """Return poses within `MIN_GAIN_NATS` of the best, with a limb elsewhere than in the present pose, cheapest first.

    Their costs are relative to that of the present pose, nats: negative ones are better. Other people stay.

    Args:
        known: appearance of the people and places of the run.
        observer: of the recording.
        frame: frame number.
        bodies: all people in their present poses.
        person: index of the person.
        settings: of the tracker.
        tried: poses and limbs of the person.
    """
    model, present = bodies[person].model, bodies[person]
    everywhere = [bodies, *(with_body(bodies, person, PosedBody(model, p)) for p in (*tried.stored, *tried.around))]
    views = common_evidence(observer, frame, everywhere, settings)
    evidence = FrameEvidence(views, known, known.frame(views, bodies), None, tried.active_dofs)
    found = list(tried.stored)
    if tried.limbs:
        repair = better_limbs(evidence, bodies, person, settings, tried.limbs, tried.around)
        found += [repair.pose, *(other.pose for other in repair.alternatives)]
    poses = [present.values, *found]
    scorer = scorer_without_prediction(views, bodies, person, settings)
    of_colors = [known.nats(evidence.regions, with_body(bodies, person, PosedBody(model, p))) for p in poses]
    costs = scorer.costs_with_priors(model, np.array(poses)) - of_colors
    others = [Hypothesis(PosedBody(model, p), cost=float(c - costs[0])) for p, c in zip(found, costs[1:], strict=True)]
    best = min([0.0, *(other.cost for other in others)])
    is_near = [o for o in distinct(others) if o.cost < best + MIN_GAIN_NATS]
    return [o for o in is_near if distance_m(o.body, present) > SAME_POSE_M]
