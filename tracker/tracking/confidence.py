"""How sure a tracker is of a pose: what the evidence says of it, and a status.

How likely each limb is lost is a logistic function of what the evidence says of it. Its weights were fitted on
simulated footage, where the error is known, and are checked on other scenes (`tests/benchmarks/calibrate_status.py`).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import ColorScore, PartColors
from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import PosedBody
from tracker.fitting.contour_residuals import PartCosts
from tracker.fitting.gauss_newton import Fit, covariance
from tracker.geometry.arrays import Array

Status = Literal["good", "doubtful", "lost"]

_LEAST_SAMPLES = 12
"""Colours of fewer samples say nothing about a part."""
_LEAST_PX = 5.0
"""Contours shorter than this explain as little as one of this length."""
_LEAST_TRUST = 0.5
"""Silhouettes trusted less have no say."""
_MOST_UNEXPLAINED = 0.07
"""A silhouette of whose contour more than this is explained by no part shows a limb that is elsewhere."""
_WEIGHTS = np.array([-1.611, 0.579, 2.663, 5.724, 6.632, -2.025, -2.906, -5.704])
"""Of the evidence in `evidence`, in its order; the last is the constant."""
_DOUBTFUL, _LOST = -3.8, 0.0
"""Log odds that a limb is lost from which on the frame is doubtful, and lost. Few limbs are lost, and a lost one that
is called good is the costlier error: doubt begins at 1 to 45."""
_SUSPECT, _SUSPECT_OF_SEVERAL = -3.5, -3.0
"""From which on a limb is searched for, of somebody alone and of one of several. A search is begun nearly as soon as
there is doubt: it costs time, and a limb that is left astray leads the frames after it astray. Among several people
half of all limbs are in doubt, and what is searched in vain may find what is another's."""
_LOST_FORWARD = 0.6
"""Of a body whose contours are farther than this from all edges, in outlier distances, nothing holds."""


class LimbFeatures(NamedTuple):
    """What the evidence says of one limb."""

    name: str
    """Name of its last part."""
    color: float
    """Colours under the part that is worst off: how much likelier on this part than elsewhere, nats per sample."""
    worst_drop: float
    """How much less that is than where the colours were learnt, in the view in which it is most, nats per sample."""
    spread_px: float
    """Standard deviation of its end, working px where the body stands."""
    forward: float
    """Mean cut-off distance of its visible contour to the edges, in outlier distances; 0 where nothing is visible."""
    shown: float
    """Length of its visible contour in the views that see the body, as a share of what it would be from the side."""
    explained: float
    """Points of edges and silhouette that it explains, for each pixel of its visible contour."""


class PoseQuality(NamedTuple):
    """What the evidence says of a pose. Distances are in outlier distances."""

    forward: float
    """Mean cut-off distance of the visible contour to the edges."""
    views: int
    """Views that see the body."""
    unexplained: float
    """Share of the silhouette's contour that no part explains, in the second worst of the trusted views."""
    limbs: tuple[LimbFeatures, ...]
    """The same limb by limb."""

    @property
    def log_odds(self) -> Array:
        """Log odds that each limb is lost, (n_limbs,)."""
        return _log_odds(self)

    def doubtful_limbs(self, alone: bool) -> tuple[str, ...]:
        """Names of limbs that seem lost themselves, of somebody alone or of one of several."""
        least = _SUSPECT if alone else _SUSPECT_OF_SEVERAL
        return tuple(x.name for x, odds in zip(self.limbs, self.log_odds, strict=True) if odds > least)

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of limbs that are likelier lost than found."""
        return tuple(x.name for x, odds in zip(self.limbs, self.log_odds, strict=True) if odds > _LOST)

    def search_candidates(self, alone: bool) -> tuple[str, ...]:
        """Names of limbs worth a search, likeliest first; all where the image shows what no part explains."""
        doubtful_limbs, everyone = self.doubtful_limbs(alone), self.unexplained > _MOST_UNEXPLAINED
        names = [self.limbs[i].name for i in np.argsort(-self.log_odds)]
        return tuple(name for name in names if everyone or name in doubtful_limbs)

    @property
    def is_body_lost(self) -> bool:
        """Whether the body stands elsewhere, not a limb or two of it."""
        return self.views == 0 or self.forward > _LOST_FORWARD or 2 * len(self.lost) > len(self.limbs)


def features(found: PoseQuality, limb: LimbFeatures) -> Array:
    """What the log odds of a limb are made of, (7,)."""
    return np.array([
        np.clip(limb.color, -2, 1),
        np.clip(limb.worst_drop, -0.5, 3),
        np.log(np.clip(limb.spread_px, 0.5, 50)),
        min(found.unexplained, _MOST_UNEXPLAINED),
        limb.forward,
        np.log(np.clip(limb.shown, 0.02, 2)),
        min(limb.explained, 1),
    ])  # fmt: skip


@lru_cache(maxsize=8)  # asked several times for each frame
def _log_odds(found: PoseQuality) -> Array:
    odds = np.array([_WEIGHTS @ [*features(found, x), 1.0] for x in found.limbs])
    odds.flags.writeable = False
    return odds


def quality(
    body: PosedBody,
    fit: Fit,
    costs: PartCosts,
    thetas_px: Array,
    trusts: Array,
    px_per_m: float,
    colors: tuple[ColorScore, PartColors] | None,
) -> PoseQuality:
    """Sum up what speaks for and against a pose.

    Args:
        body: in the pose that was found.
        fit: that pose, and the normal matrix there.
        costs: of its parts.
        thetas_px: outlier distance of each view, (V,), working px.
        trusts: how far the silhouette of each view is trusted, (V,), 0 to 1; 0 where there is none.
        px_per_m: length of a metre in the images where the body stands, working px.
        colors: of its parts; None where there are none.
    """
    model, chains = body.model, limbs(body.model)
    far = np.nan_to_num(costs.forward_px) / thetas_px[:, None] * costs.length_px
    views = int(np.count_nonzero(costs.length_px.sum(axis=1) > 0))
    beside_px = 2.0 * px_per_m * max(1, views) * np.array([2.0 * s.half_axes[2] for s in model.shapes])
    color, worst_drop = np.full(len(model.parts), np.inf), np.zeros(len(model.parts))
    if colors is not None:
        score, known = colors
        color = np.where(score.samples >= _LEAST_SAMPLES, score.parts, np.inf)
        worst_drop = np.nan_to_num(known.usual - score.views, nan=-np.inf).max(axis=0, initial=-np.inf)
    spreads = px_per_m * _end_spreads(body, fit)
    return PoseQuality(
        float(far.sum() / max(1e-9, costs.length_px.sum())),
        views,
        _second_largest(1.0 - costs.silhouette[trusts > _LEAST_TRUST]),
        tuple(
            LimbFeatures(
                c.name, float(color[c.parts].min()), float(worst_drop[c.parts].max()), float(spread),
                *_of_contour(costs, far, beside_px, c.parts),
            )
            for c, spread in zip(chains, spreads, strict=True)
        ),
    )  # fmt: skip


def _of_contour(costs: PartCosts, far: Array, beside_px: Array, parts: NDArray[np.int64]) -> tuple[float, float, float]:
    """The figures `forward`, `shown` and `explained` of some parts.

    Args:
        costs: of all parts.
        far: summed distance of their contours, (V, n_parts), px times outlier distances.
        beside_px: length of their contours if they were seen from the side, in all views together, (n_parts,), px.
        parts: which are asked.
    """
    length = float(costs.length_px[:, parts].sum())
    forward = float(far[:, parts].sum()) / max(1e-9, length)
    return forward, length / float(beside_px[parts].sum()), float(costs.points[:, parts].sum()) / max(_LEAST_PX, length)


def _second_largest(shares: Array) -> float:
    """What at least two views say; 0 where there are fewer."""
    return float(np.sort(shares)[-2]) if len(shares) > 1 else 0.0


def classify(found: PoseQuality) -> Status:
    """Good, doubtful or lost."""
    most = found.log_odds.max(initial=-np.inf)
    if found.is_body_lost or most > _LOST:
        return "lost"
    return "doubtful" if most > _DOUBTFUL or found.unexplained > _MOST_UNEXPLAINED else "good"


def reason(found: PoseQuality) -> str:
    """What speaks most against a pose, for people; empty where it is good."""
    if classify(found) == "good":
        return ""
    if found.views == 0:
        return "no view shows the body"
    if found.forward > _LOST_FORWARD:
        return "no edges near the body"
    odds = found.log_odds
    if odds.max() <= _DOUBTFUL:
        return "part of the silhouette unexplained"
    return f"{limb_display_name(found.limbs[int(odds.argmax())].name)} uncertain"


def worst(statuses: Sequence[Status]) -> Status:
    """The worst of several."""
    return max(statuses, key=("good", "doubtful", "lost").index, default="good")


def _end_spreads(body: PosedBody, fit: Fit) -> Array:
    """Standard deviation of the end of each limb, (n_limbs,), metres."""
    model = body.model
    ends = np.array([np.flatnonzero(model.point_parts == c.parts[-1])[-1] for c in limbs(model)], dtype=np.int64)
    J = model.point_jacobian(body.kinematics, model.point_parts[ends], body.points_world[ends])
    return np.sqrt(np.trace(J @ covariance(model, fit) @ np.swapaxes(J, 1, 2), axis1=1, axis2=2))
