"""Region evidence of a finished run: how far each part and limb is below its usual."""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.estimation.appearance.part_colors import counterparts
from tracker.geometry.arrays import Array, IntArray

_QUARTILES = (25.0, 75.0)
"""Percentiles over the run between which half of the evidence lies. The upper one is usual: on runs that lost a limb
half of the time the median showed it as usual."""


def usual(evidence: Array, models: Sequence[BodyModel]) -> Array:
    """Return the usual evidence of each part, (P,): an upper percentile of that over a run, (T, P), of the better side.

    A limb that is lost during most of a run has a counterpart that is not.
    """
    high = np.percentile(evidence, _QUARTILES[1], axis=0)
    return np.asarray(np.maximum(high, high[counterparts(models)]))


def elsewhere_nats(nats: Array, models: Sequence[BodyModel]) -> Array:
    """Return how much likelier each part is elsewhere than where it is drawn, (T, P), nats.

    Where a part is, its evidence on a frame is normal around its usual, as widely as over the run. Elsewhere it is
    normal around 0, as widely. This is the log ratio of both. A part that looks like its surroundings, and one that is
    often hidden, therefore say little. Each side varies around its own: a leg that is lost in all frames lies below the
    other one, which does not make either vary. Evidence counts as it is, not per visible sample: a limb that is lost
    behind the body loses samples.

    Args:
        nats: evidence in all views, (T, P): `RegionScore.nats` of each frame, summed over the views.
        models: all people.
    """
    best, below = usual(nats, models), nats - np.percentile(nats, _QUARTILES[1], axis=0)
    low, high = np.percentile(np.concatenate([below, below[:, counterparts(models)]]), _QUARTILES, axis=0)
    spread = np.maximum(0.5 * MAD_TO_SIGMA * (high - low), np.sqrt(np.maximum(best, 1.0)))
    return np.asarray(best * (best - 2 * nats) / (2 * spread**2))


def worst_parts(elsewhere: Array, models: Sequence[BodyModel]) -> IntArray:
    """Return the index of the part of each limb of all people that is likeliest elsewhere, (T, n_limbs).

    Args:
        elsewhere: see `elsewhere_nats`, (T, P).
        models: all people.
    """
    columns, first = list[IntArray](), 0
    for model in models:
        columns += [first + limb.parts[elsewhere[:, first + limb.parts].argmax(axis=1)] for limb in limbs(model)]
        first += len(model.parts)
    return np.stack(columns, axis=1)


def worst_views(nats: Array, models: Sequence[BodyModel]) -> IntArray:
    """Return the index of the view in which each part lacks most of its usual evidence there, (T, P).

    Args:
        nats: evidence in each view, (T, V, P).
        models: all people.
    """
    lacks = np.stack([usual(of_view, models) - of_view for of_view in nats.transpose(1, 0, 2)])
    return np.asarray(lacks.argmax(axis=0))
