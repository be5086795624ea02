"""Classify a pose as good, doubtful or lost, from features of how well it fits the evidence.

The log odds that a limb is off are linear in its features. One set of weights serves two thresholds: a joint of the
limb is off by more than 100 mm, or by more than 150 mm. The weights were fitted on simulated people of many builds,
where the error is known (`tests/benchmarks/calibrate_status.py`).

Searches have odds of their own: they begin before the pose is settled, and a needless search costs only time.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import ColorScore, PartColors
from tracker.body.limbs import Limb, limb_display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import PartCosts
from tracker.fitting.gauss_newton import Fit, covariance
from tracker.geometry.arrays import Array
from tracker.tracking.silhouette_overlap import AxisSamples, axis_samples
from tracker.tracking.view_regions import px_per_m

Status = Literal["good", "doubtful", "lost"]

_MIN_SAMPLES = 12
"""Fewest colour samples of a part that count."""
_MIN_LENGTH_PX = 5.0
"""Shortest contour length that the explained points are divided by, px."""
_MIN_TRUST = 0.5
"""Silhouettes trusted less are left out."""
_LIMIT_RAD = 0.05
"""An angle is at its limit where it is nearer, rad."""
_WEIGHTS = np.array([-0.241, 0.309, 2.037, 8.293, -2.248, 1.241, 5.118, -0.869])
"""Weights of `features`, in their order."""
_OFF_CONSTANT, _LOST_CONSTANT = -6.34, -7.585
"""Constants of the log odds that a joint of a limb is off by more than 100 mm, and by more than 150 mm."""


def _odds(probability: float) -> float:
    """Return the log odds of a probability."""
    return float(np.log(probability / (1.0 - probability)))


OFF_ODDS, LOST_ODDS = _odds(0.05), _odds(0.15)
"""A limb is doubtful above these log odds that a joint is off by more than 100 mm, and lost above these that one is by
more than 150 mm. To call a wrong pose good is the worse error."""
_DOUBTFUL_ODDS = OFF_ODDS + _LOST_CONSTANT - _OFF_CONSTANT
"""Log odds of a lost limb where the odds that it is off are `OFF_ODDS`."""
DOUBTFUL_FROM, LOST_FROM = (float(1.0 / (1.0 + np.exp(-odds))) for odds in (_DOUBTFUL_ODDS, LOST_ODDS))
"""Probabilities of a lost limb above which it is doubtful, and lost."""

_SEARCH_WEIGHTS = np.array([-1.611, 0.579, 2.663, 5.724, 6.632, -2.025, -2.906, -5.704])
"""Weights of `search_features`, in their order, and the constant."""
_SEARCH, _SEARCH_OF_SEVERAL = -3.5, -3.0
"""Search odds above which a limb is searched, of a single person and of one of several. A wrong limb misleads the
frames after it, so that a search begins early. Among several people a search may take another person's limb."""
_MAX_UNEXPLAINED = 0.07
"""A larger unexplained share of a silhouette's contour shows a limb that is elsewhere."""
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
    outside: float
    """Share of its axis outside the silhouette, mean over the views that show it and have a trusted one; 0 where there
    is none."""
    at_limits: float
    """Share of its degrees of freedom at a limit. A limb that is drawn to wrong edges bends as far as it can."""


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
        """Log odds that a joint of each limb is off by more than 150 mm, (n_limbs,)."""
        return _log_odds(self)

    @property
    def lost_probabilities(self) -> Array:
        """Probability that a joint of each limb is off by more than 150 mm, (n_limbs,), 0 to 1."""
        return np.asarray(1.0 / (1.0 + np.exp(-self.log_odds)))

    @property
    def is_unseen(self) -> bool:
        """Whether no edge is near the body."""
        return self.views == 0 or self.forward > _LOST_FORWARD

    @property
    def search_odds(self) -> Array:
        """Log odds by which limbs are searched, (n_limbs,)."""
        return _search_odds(self)

    def search_odds_of(self, limb: str) -> float:
        """Return the log odds by which the limb of a name is searched."""
        return float(self.search_odds[[x.name for x in self.limbs].index(limb)])

    def doubtful_limbs(self, alone: bool) -> tuple[str, ...]:
        """Return the names of limbs that are worth a search themselves, of a single person or of one of several."""
        least = _SEARCH if alone else _SEARCH_OF_SEVERAL
        return self._searched_from(least)

    @property
    def missing_limbs(self) -> tuple[str, ...]:
        """Names of limbs that are more likely elsewhere than not, by their search odds."""
        return self._searched_from(0.0)

    def search_candidates(self, alone: bool) -> tuple[str, ...]:
        """Return the limbs to search, most likely lost first; all limbs if part of the silhouette is unexplained."""
        doubtful, all_limbs = self.doubtful_limbs(alone), self.unexplained > _MAX_UNEXPLAINED
        names = [self.limbs[i].name for i in np.argsort(-self.search_odds)]
        return tuple(name for name in names if all_limbs or name in doubtful)

    @property
    def is_body_lost(self) -> bool:
        """Whether the whole body is searched, not only a limb or two."""
        return self.is_unseen or 2 * len(self.missing_limbs) > len(self.limbs)

    def _searched_from(self, least: float) -> tuple[str, ...]:
        return tuple(x.name for x, odds in zip(self.limbs, self.search_odds, strict=True) if odds > least)


def features(pose: PoseQuality, limb: LimbFeatures) -> Array:
    """Return the features of a limb from which its status follows, (8,)."""
    return np.array([
        np.clip(limb.color, -2, 1),
        np.clip(limb.worst_drop, -0.5, 3),
        np.log(np.clip(limb.spread_px, 0.5, 50)),
        limb.forward,
        np.log(np.clip(limb.shown, 0.02, 2)),
        limb.outside,
        limb.at_limits,
        np.log(max(1, pose.views)),
    ])  # fmt: skip


def search_features(pose: PoseQuality, limb: LimbFeatures) -> Array:
    """Return the features of a limb by which it is searched, (7,)."""
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
    odds = np.array([_WEIGHTS @ features(found, x) + _LOST_CONSTANT for x in found.limbs])
    odds.flags.writeable = False
    return odds


@lru_cache(maxsize=8)
def _search_odds(found: PoseQuality) -> Array:
    odds = np.array([_SEARCH_WEIGHTS @ [*search_features(found, x), 1.0] for x in found.limbs])
    odds.flags.writeable = False
    return odds


def quality(
    body: PosedBody,
    fit: Fit,
    costs: PartCosts,
    views: Sequence[ViewEvidence],
    thetas_px: Array,
    colors: tuple[ColorScore, PartColors] | None,
) -> PoseQuality:
    """Compute the features of a pose.

    Args:
        body: in the pose.
        fit: the pose, and the normal matrix there.
        costs: of its parts.
        views: the evidence of each view.
        thetas_px: outlier distance of each view, (V,), working px.
        colors: scores of the colours, and the colours that were learnt; None before the first frame.
    """
    model, chains = body.model, limbs(body.model)
    far = np.nan_to_num(costs.forward_px) / thetas_px[:, None] * costs.length_px
    n_views = int(np.count_nonzero(costs.length_px.sum(axis=1) > 0))
    scale = px_per_m([v.camera for v in views], body)
    beside_px = 2.0 * scale * max(1, n_views) * np.array([2.0 * s.half_axes[2] for s in model.shapes])
    color, worst_drop = np.full(len(model.parts), np.inf), np.zeros(len(model.parts))
    if colors is not None:
        score, known = colors
        color = np.where(score.samples >= _MIN_SAMPLES, score.parts, np.inf)
        worst_drop = np.nan_to_num(known.usual - score.views, nan=-np.inf).max(axis=0, initial=-np.inf)
    spreads = scale * _end_spreads(body, fit)
    trusted = np.array([v.silhouette is not None and v.silhouette.trust > _MIN_TRUST for v in views], dtype=bool)
    samples = [axis_samples(v, body) for v, is_trusted in zip(views, trusted, strict=True) if is_trusted]
    return PoseQuality(
        float(far.sum() / max(1e-9, costs.length_px.sum())),
        n_views,
        _second_largest(1.0 - costs.silhouette[trusted]),
        tuple(
            LimbFeatures(
                c.name, float(color[c.parts].min()), float(worst_drop[c.parts].max()), float(spread),
                *_of_contour(costs, far, beside_px, c.parts),
                _share_outside(samples, c.parts),
                _share_at_limits(model, body.values, c),
            )
            for c, spread in zip(chains, spreads, strict=True)
        ),
    )  # fmt: skip


def _share_outside(samples: Sequence[AxisSamples], parts: NDArray[np.int64]) -> float:
    """Return the share of some parts outside the silhouette, mean over the views that show them; 0 without a view."""
    return float(np.mean([x.share_outside(parts) for x in samples if x.shown[parts].any()] or [0.0]))


def _share_at_limits(model: BodyModel, pose: Array, limb: Limb) -> float:
    """Return the share of a limb's degrees of freedom that are at a limit in a pose, (n_values,)."""
    values = pose[model.dof_value[limb.dofs], None]
    return float(np.mean(np.abs(model.limits[limb.dofs] - values).min(axis=1) < _LIMIT_RAD))


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
    if found.is_unseen or most > LOST_ODDS:
        return "lost"
    return "doubtful" if most > _DOUBTFUL_ODDS else "good"


def reason(found: PoseQuality) -> str:
    """Return the main reason against a pose, for people to read; empty where it is good."""
    if classify(found) == "good":
        return ""
    if found.views == 0:
        return "no view shows the body"
    if found.forward > _LOST_FORWARD:
        return "no edges near the body"
    return f"{limb_display_name(found.limbs[int(found.log_odds.argmax())].name)} uncertain"


def worst(statuses: Sequence[Status]) -> Status:
    """Return the worst of several statuses; "good" for none."""
    return max(statuses, key=("good", "doubtful", "lost").index, default="good")


def _end_spreads(body: PosedBody, fit: Fit) -> Array:
    """Return the standard deviation of the end of each limb, (n_limbs,), metres."""
    model = body.model
    ends = np.array([np.flatnonzero(model.point_parts == c.parts[-1])[-1] for c in limbs(model)], dtype=np.int64)
    J = model.point_jacobian(body.kinematics, model.point_parts[ends], body.points_world[ends])
    return np.sqrt(np.trace(J @ covariance(model, fit) @ np.swapaxes(J, 1, 2), axis1=1, axis2=2))
