"""Classify a pose as good, doubtful or lost, from features of how well it fits the evidence.

The log odds that a limb is lost are linear in its features. The weights were fitted on simulated footage, where the
error is known, and are checked on other scenes (`tests/benchmarks/calibrate_status.py`).
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

_MIN_SAMPLES = 12
"""Fewest colour samples of a part that count."""
_MIN_LENGTH_PX = 5.0
"""Shortest contour length that the explained points are divided by, px."""
_MIN_TRUST = 0.5
"""Silhouettes trusted less are left out."""
_MAX_UNEXPLAINED = 0.07
"""A larger unexplained share of a silhouette's contour shows a limb that is elsewhere."""
_WEIGHTS = np.array([-1.611, 0.579, 2.663, 5.724, 6.632, -2.025, -2.906, -5.704])
"""Weights of `features`, in their order, and the constant."""
_DOUBTFUL, _LOST = -3.8, 0.0
"""Log odds of a lost limb above which a frame is doubtful, and lost. Few limbs are lost, and to call a lost limb good
is the worse error: a frame is doubtful from odds of 1 to 45."""
DOUBTFUL_FROM, LOST_FROM = (float(1.0 / (1.0 + np.exp(-odds))) for odds in (_DOUBTFUL, _LOST))
"""The same as probabilities: a limb that is lost with a higher one is doubtful, or lost."""
_SEARCH, _SEARCH_OF_SEVERAL = -3.5, -3.0
"""Log odds above which a limb is searched, of a single person and of one of several. A wrong limb misleads the frames
after it, so that a search begins nearly as early as doubt. Among several people half of all limbs are in doubt, and a
search may take another person's limb."""
_LOST_FORWARD = 0.6
"""Mean distance of the contour to the edges above which the whole body is lost, in outlier distances."""


class LimbFeatures(NamedTuple):
    """Features of one limb."""

    name: str
    """Name of its last part."""
    color: float
    """Mean log-likelihood ratio of the colours under its worst part, part against elsewhere, nats per sample."""
    worst_drop: float
    """Largest drop of that ratio in a view, against the frame where the colours were learnt, nats per sample."""
    spread_px: float
    """Standard deviation of its end, working px at the body."""
    forward: float
    """Mean truncated distance of its visible contour to the edges, in outlier distances; 0 where nothing is visible."""
    shown: float
    """Length of its visible contour in the views that see the body, relative to that seen from the side."""
    explained: float
    """Number of edge and silhouette points that it explains, per pixel of its visible contour."""


class PoseQuality(NamedTuple):
    """Features of a pose. Distances are in outlier distances."""

    forward: float
    """Mean truncated distance of the visible contour to the edges."""
    views: int
    """Number of views that see the body."""
    unexplained: float
    """Share of the silhouette's contour that no part explains, in the second worst trusted view."""
    limbs: tuple[LimbFeatures, ...]
    """Features of each limb."""

    @property
    def log_odds(self) -> Array:
        """Log odds that each limb is lost, (n_limbs,)."""
        return _log_odds(self)

    @property
    def lost_probabilities(self) -> Array:
        """Probability that each limb is lost, (n_limbs,), 0 to 1."""
        return np.asarray(1.0 / (1.0 + np.exp(-self.log_odds)))

    def doubtful_limbs(self, alone: bool) -> tuple[str, ...]:
        """Return the names of limbs that seem lost, of a single person or of one of several."""
        least = _SEARCH if alone else _SEARCH_OF_SEVERAL
        return tuple(x.name for x, odds in zip(self.limbs, self.log_odds, strict=True) if odds > least)

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of limbs that are more likely lost than not."""
        return tuple(x.name for x, odds in zip(self.limbs, self.log_odds, strict=True) if odds > _LOST)

    def search_candidates(self, alone: bool) -> tuple[str, ...]:
        """Return the limbs to search, most likely lost first; all limbs if part of the silhouette is unexplained."""
        doubtful, all_limbs = self.doubtful_limbs(alone), self.unexplained > _MAX_UNEXPLAINED
        names = [self.limbs[i].name for i in np.argsort(-self.log_odds)]
        return tuple(name for name in names if all_limbs or name in doubtful)

    @property
    def is_body_lost(self) -> bool:
        """Whether the whole body is lost, not only a limb or two."""
        return self.views == 0 or self.forward > _LOST_FORWARD or 2 * len(self.lost) > len(self.limbs)


def features(pose: PoseQuality, limb: LimbFeatures) -> Array:
    """Return the features of a limb that the classifier weighs, (7,)."""
    return np.array([
        np.clip(limb.color, -2, 1),
        np.clip(limb.worst_drop, -0.5, 3),
        np.log(np.clip(limb.spread_px, 0.5, 50)),
        min(pose.unexplained, _MAX_UNEXPLAINED),
        limb.forward,
        np.log(np.clip(limb.shown, 0.02, 2)),
        min(limb.explained, 1),
    ])  # fmt: skip


@lru_cache(maxsize=8)  # used several times for each frame
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
    """Compute the features of a pose.

    Args:
        body: in the pose.
        fit: the pose, and the normal matrix there.
        costs: of its parts.
        thetas_px: outlier distance of each view, (V,), working px.
        trusts: trust in the silhouette of each view, (V,), 0 to 1; 0 where there is none.
        px_per_m: length of a metre in the images at the body, working px.
        colors: scores of the colours, and the colours that were learnt; None before the first frame.
    """
    model, chains = body.model, limbs(body.model)
    far = np.nan_to_num(costs.forward_px) / thetas_px[:, None] * costs.length_px
    views = int(np.count_nonzero(costs.length_px.sum(axis=1) > 0))
    beside_px = 2.0 * px_per_m * max(1, views) * np.array([2.0 * s.half_axes[2] for s in model.shapes])
    color, worst_drop = np.full(len(model.parts), np.inf), np.zeros(len(model.parts))
    if colors is not None:
        score, known = colors
        color = np.where(score.samples >= _MIN_SAMPLES, score.parts, np.inf)
        worst_drop = np.nan_to_num(known.usual - score.views, nan=-np.inf).max(axis=0, initial=-np.inf)
    spreads = px_per_m * _end_spreads(body, fit)
    return PoseQuality(
        float(far.sum() / max(1e-9, costs.length_px.sum())),
        views,
        _second_largest(1.0 - costs.silhouette[trusts > _MIN_TRUST]),
        tuple(
            LimbFeatures(
                c.name, float(color[c.parts].min()), float(worst_drop[c.parts].max()), float(spread),
                *_of_contour(costs, far, beside_px, c.parts),
            )
            for c, spread in zip(chains, spreads, strict=True)
        ),
    )  # fmt: skip


def _of_contour(costs: PartCosts, far: Array, beside_px: Array, parts: NDArray[np.int64]) -> tuple[float, float, float]:
    """Return the features `forward`, `shown` and `explained` of some parts.

    Args:
        costs: of all parts.
        far: summed distance of their contours, (V, n_parts), px times outlier distances.
        beside_px: length of their contours seen from the side, summed over the views, (n_parts,), px.
        parts: indices of the parts.
    """
    length = float(costs.length_px[:, parts].sum())
    forward = float(far[:, parts].sum()) / max(1e-9, length)
    return (
        forward,
        length / float(beside_px[parts].sum()),
        float(costs.points[:, parts].sum()) / max(_MIN_LENGTH_PX, length),
    )


def _second_largest(shares: Array) -> float:
    """Return the second largest share; 0 where there are fewer than two."""
    return float(np.sort(shares)[-2]) if len(shares) > 1 else 0.0


def classify(found: PoseQuality) -> Status:
    """Return the status of a pose."""
    most = found.log_odds.max(initial=-np.inf)
    if found.is_body_lost or most > _LOST:
        return "lost"
    return "doubtful" if most > _DOUBTFUL or found.unexplained > _MAX_UNEXPLAINED else "good"


def reason(found: PoseQuality) -> str:
    """Return the main reason against a pose, for people to read; empty where it is good."""
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
    """Return the worst of several statuses; "good" for none."""
    return max(statuses, key=("good", "doubtful", "lost").index, default="good")


def _end_spreads(body: PosedBody, fit: Fit) -> Array:
    """Return the standard deviation of the end of each limb, (n_limbs,), metres."""
    model = body.model
    ends = np.array([np.flatnonzero(model.point_parts == c.parts[-1])[-1] for c in limbs(model)], dtype=np.int64)
    J = model.point_jacobian(body.kinematics, model.point_parts[ends], body.points_world[ends])
    return np.sqrt(np.trace(J @ covariance(model, fit) @ np.swapaxes(J, 1, 2), axis1=1, axis2=2))
