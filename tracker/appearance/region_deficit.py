"""Region evidence of a finished run: how far each part and limb is below its usual."""

from collections.abc import Sequence

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, IntArray

_USUAL_PERCENTILE = 75.0
"""Percentile over the run that is usual. On runs that lost a limb half of the time the median showed it as usual."""
UNEXPLAINED_SHARE = 0.5
"""Weight of evidence that no part covers: parts may lie beside each other, and both would explain it."""


def usual(evidence: Array, models: Sequence[BodyModel]) -> Array:
    """Return the usual evidence of each part, (P,): an upper percentile of that over a run, (T, P), of the better side.

    A limb that is lost during most of a run has a counterpart that is not.
    """
    high = np.percentile(evidence, _USUAL_PERCENTILE, axis=0)
    return np.asarray(np.maximum(high, high[counterparts(models)]))


def part_deficits(nats: Array, models: Sequence[BodyModel]) -> Array:
    """Return how far the evidence of each part on each frame is below its usual, (T, P), nats.

    Evidence counts as it is, not per visible sample: a limb that is lost behind the body loses samples.

    Args:
        nats: evidence in all views, (T, P): `RegionScore.nats` of each frame, summed over the views.
        models: all people.
    """
    return usual(nats, models) - nats


def limb_deficits(nats: Array, unexplained: Array, models: Sequence[BodyModel]) -> Array:
    """Return the deficit of each limb on each frame, (T, n_limbs), nats.

    It is the deficit of its worst part, and some of the evidence that is unexplained beyond the median of the run.

    Args:
        nats: see `part_deficits`.
        unexplained: `RegionScore.unexplained` of each frame, summed over the views, (T, n_limbs).
        models: all people.
    """
    parts, columns, first = part_deficits(nats, models), list[Array](), 0
    for model in models:
        columns += [parts[:, first + limb.parts].max(axis=1) for limb in limbs(model)]
        first += len(model.parts)
    more = unexplained - np.median(unexplained, axis=0)
    return np.stack(columns, axis=1) + UNEXPLAINED_SHARE * more


def counterparts(models: Sequence[BodyModel]) -> IntArray:
    """Return the index of each part's counterpart on the other side, or of itself without one, (P,)."""
    out, first = list[int](), 0
    for model in models:
        names = [p.name for p in model.parts]
        swapped = [n.replace("left", "?").replace("right", "left").replace("?", "right") for n in names]
        out += [first + (names.index(n) if n in names else i) for i, n in enumerate(swapped)]
        first += len(names)
    return np.array(out)
