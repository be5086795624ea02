"""Classify a pose as good, doubtful or lost, from features of how well it fits the evidence.

The log odds that a limb is off are linear in its features. One set of weights serves two thresholds: a joint of the
limb is off by more than 100 mm, or by more than 150 mm. The weights were fitted on simulated people of many builds,
where the error is known (`tests/benchmarks/calibrate_status.py`).

Searches have odds of their own: they begin before the pose is settled, and a needless search costs only time. At the
end of a run `pose_errors` classifies its poses again.

Remarks on a pose, for people to read. Several are joined by commas.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import Limb, limb_display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.appearance.part_colors import MIN_SAMPLES, ColorScore
from tracker.estimation.fitting.contour_residuals import PartCosts
from tracker.estimation.fitting.gauss_newton import Fit, covariance
from tracker.estimation.fitting.hypothesis import Hypothesis, limbs_elsewhere
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import TINY, Array, IntArray, Mask
from tracker.geometry.cameras import px_per_m

Status = Literal["good", "doubtful", "lost"]

_MIN_LENGTH_PX = 5.0
"""Shortest contour length that the explained points are divided by, px."""
_MIN_SHOWN = 0.2
"""A view shows a limb where more of its contour is visible, relative to that seen from the side."""
NEXT_TO_NOTHING = 0.005
"""Added to a feature before its logarithm, body heights or outlier distances, so that smaller ones hardly count."""
_HEAD = "head"
"""Name of the limb that looks different from each side."""
_LIMIT_RAD = 0.05
"""An angle is at its limit where it is nearer, rad."""


class StatusModel(NamedTuple):
    """Log odds that a joint of a limb is wrong, linear in features of the limb."""

    weights: Array
    """Weights of the features, in their order."""
    off: float
    """Constant of the log odds that a joint is off by more than 100 mm."""
    lost: float
    """Constant of the log odds that a joint is off by more than 150 mm."""


STATUS_MODEL = StatusModel(np.array([2.893, 4.401, -2.282, -2.963, 3.508, 0.282, 13.031, -1.814]), 1.042, -0.973)
"""Log odds by `features`, fitted by `tests/benchmarks/calibrate_status.py`."""
LOST_NATS = STATUS_MODEL.off - STATUS_MODEL.lost
"""How much less likely a limb is lost than off, nats."""


def _odds(probability: float) -> float:
    """Return the log odds of a probability."""
    return float(np.log(probability / (1.0 - probability)))


OFF_ODDS, LOST_ODDS = _odds(0.05), _odds(0.25)
"""A limb is doubtful above these log odds that a joint is off by more than 100 mm, and lost above these that one is by
more than 150 mm. To call a wrong pose good is the worse error."""
SEARCH_ODDS = _odds(0.02)
"""A limb is searched above these log odds that it is off: before it is doubtful, because a wrong limb misleads the
frames after it. With 5%, 41 poses of nine simulated scenes with few pictures are off, with 2% 29; `fast_arms` ends at
19.7 mm with either."""
_LOST_FORWARD = 0.5
"""Mean distance of the contour to the edges above which the whole body is lost, in outlier distances. Edges that have
nothing to do with the body lie anywhere within that distance, in the mean half as far."""


class LimbFeatures(NamedTuple):
    """Features of one limb."""

    name: str
    """Name of its last part."""
    at_limits: float
    """Share of its degrees of freedom at a limit. A limb that is drawn to wrong edges bends as far as it can."""
    free_spread_px: float
    """Standard deviation of its end where the prediction of each pose counts alike, and little, working px at the
    body."""
    second_forward: float
    """Mean truncated distance of its visible contour to the edges in the second worst of the views that show it, in
    outlier distances; that of the body where none does. A limb at wrong edges fits those of some views only."""
    end_color: float
    """Mean log-likelihood ratio of the colours under its last part, part against elsewhere, nats per sample; infinite
    where little of it is visible, and of the head: hair and face differ."""
    end_explained: float
    """Number of edge and silhouette points that its last part explains, per pixel of visible contour, relative to that
    of the body. Without silhouettes all parts explain less."""
    innovation: float
    """Largest distance of its points from the prediction, in body heights."""


class PoseQuality(NamedTuple):
    """Features of a pose. Distances are in outlier distances."""

    forward: float
    """Mean truncated distance of the visible contour to the edges."""
    views: int
    """Number of views that see the body."""
    trunk_forward: float
    """`forward` of the parts of no limb."""
    limbs: tuple[LimbFeatures, ...]
    """Features of each limb."""

    @property
    def log_odds(self) -> Array:
        """Log odds that a joint of each limb is off by more than 150 mm, (n_limbs,)."""
        return _log_odds(self)

    @property
    def lost_probabilities(self) -> Array:
        """Probability that a joint of each limb is off by more than 150 mm, (n_limbs,), 0 to 1."""
        return probabilities(self.log_odds)

    @property
    def is_unseen(self) -> bool:
        """Whether no edge is near the body."""
        return self.views == 0 or self.forward > _LOST_FORWARD

    @property
    def off_odds(self) -> Array:
        """Log odds that a joint of each limb is off by more than 100 mm, (n_limbs,). Limbs are searched by them."""
        return _log_odds(self) + LOST_NATS

    def off_odds_of(self, limb: str) -> float:
        """Return the log odds by which the limb of a name is searched."""
        return float(self.off_odds[[x.name for x in self.limbs].index(limb)])

    @property
    def limbs_to_search(self) -> tuple[str, ...]:
        """Names of the limbs to search, most likely off first."""
        return self._beyond(SEARCH_ODDS)

    @property
    def missing_limbs(self) -> tuple[str, ...]:
        """Names of limbs that are more likely off than not."""
        return self._beyond(0.0)

    @property
    def is_body_lost(self) -> bool:
        """Whether the whole body is searched, not only a limb or two."""
        return self.is_unseen or 2 * len(self.missing_limbs) > len(self.limbs)

    def _beyond(self, least: float) -> tuple[str, ...]:
        odds = self.off_odds
        return tuple(self.limbs[i].name for i in np.argsort(-odds) if odds[i] > least)


def features(pose: PoseQuality, limb: LimbFeatures) -> Array:
    """Return the features of a limb from which its status follows, (8,)."""
    return np.array([
        np.log(np.clip(limb.free_spread_px, 0.5, 80)),
        limb.second_forward,
        np.clip(limb.end_color, -2, 1),
        min(limb.end_explained, 2),
        limb.at_limits,
        np.log(min(limb.innovation, 0.5) + NEXT_TO_NOTHING),
        pose.trunk_forward,
        np.log(max(1, pose.views)),
    ])  # fmt: skip


def probabilities(log_odds: Array) -> Array:
    """Return the probabilities of log odds, of any shape."""
    return np.asarray(1.0 / (1.0 + np.exp(-log_odds)))


@lru_cache(maxsize=8)  # used several times for each frame
def _log_odds(found: PoseQuality) -> Array:
    odds = np.array([STATUS_MODEL.weights @ features(found, x) + STATUS_MODEL.lost for x in found.limbs])
    odds.flags.writeable = False
    return odds


def quality(
    body: PosedBody,
    freed: Fit,
    costs: PartCosts,
    views: Sequence[ViewEvidence],
    thetas_px: Array,
    predicted: Array,
    colors: ColorScore | None,
) -> PoseQuality:
    """Compute the features of a pose.

    Args:
        body: in the pose.
        freed: the pose with its normal matrix where the prediction counts little.
        costs: of its parts.
        views: the evidence of each view.
        thetas_px: outlier distance of each view, (V,), working px.
        predicted: the predicted pose, (n_values,).
        colors: scores of the colours; None before the first frame.
    """
    model, chains, layout = body.model, limbs(body.model), _layout(body.model)
    far = np.nan_to_num(costs.forward_px) / thetas_px[:, None] * costs.length_px
    n_views = int(np.count_nonzero(costs.length_px.sum(axis=1) > 0))
    scale = _scale(body, views)
    beside_px = _beside_px(body, scale)
    color = np.full(len(model.parts), np.inf)
    if colors is not None:
        color = np.where(colors.samples >= MIN_SAMPLES, colors.parts, np.inf)
    free_spreads = scale * _end_spreads(body, freed, layout.ends)
    innovations = np.linalg.norm(model.points_world(predicted) - body.points_world, axis=1) / model.height_m
    contours = _Contours(costs, far, beside_px)
    forward, explained = contours.forward(slice(None)), contours.explained(slice(None))
    return PoseQuality(
        forward,
        n_views,
        contours.forward(layout.trunk),
        tuple(
            LimbFeatures(
                c.name, _share_at_limits(model, body.values, c), float(free_spread),
                contours.second_forward(c.parts, forward),
                np.inf if c.name == _HEAD else float(color[c.parts[-1]]),
                contours.explained(c.parts[-1:]) / max(NEXT_TO_NOTHING, explained),
                float(innovations[points].max()),
            )
            for c, points, free_spread in zip(chains, layout.points, free_spreads, strict=True)
        ),
    )  # fmt: skip


def views_of_limbs(body: PosedBody, costs: PartCosts, views: Sequence[ViewEvidence]) -> Mask:
    """Return whether each view shows each limb by its contour, (V, n_limbs).

    Args:
        body: in a pose.
        costs: of its parts there.
        views: the evidence of each view.
    """
    beside_px = _beside_px(body, _scale(body, views))
    return np.stack([_shows(costs, beside_px, limb.parts) for limb in limbs(body.model)], axis=1)


def _scale(body: PosedBody, views: Sequence[ViewEvidence]) -> float:
    """Return the length of a metre at a body in the images, px: the median over the views."""
    return px_per_m([v.camera for v in views], body.points_world.mean(axis=0))


def _beside_px(body: PosedBody, scale: float) -> Array:
    """Return the length of each part's contour seen from the side, (n_parts,), working px, at a scale, px per metre."""
    return np.asarray(4 * scale * np.array([s.half_axes[2] for s in body.model.shapes]))


def _shows(costs: PartCosts, beside_px: Array, parts: IntArray) -> Mask:
    """Return whether each view shows some parts, (V,)."""
    return np.asarray(costs.length_px[:, parts].sum(axis=1) > _MIN_SHOWN * beside_px[parts].sum())


class _Layout(NamedTuple):
    """Indices of the parts and points of a body, by limb."""

    trunk: IntArray
    """Parts of no limb, (n,)."""
    points: tuple[NDArray[np.bool_], ...]
    """Whether each of the body's points lies on a limb, (n_points,), by limb."""
    ends: IntArray
    """Last point of each limb, (n_limbs,)."""


@lru_cache(maxsize=32)  # as `limbs`: this takes longer than the features of a pose
def _layout(model: BodyModel) -> _Layout:
    chains = limbs(model)
    trunk = np.flatnonzero(~np.isin(np.arange(len(model.parts)), [p for c in chains for p in c.parts]))
    ends = np.array([np.flatnonzero(model.point_parts == c.parts[-1])[-1] for c in chains], dtype=np.int64)
    return _Layout(trunk, tuple(np.isin(model.point_parts, c.parts) for c in chains), ends)


def _share_at_limits(model: BodyModel, pose: Array, limb: Limb) -> float:
    """Return the share of a limb's degrees of freedom that are at a limit in a pose, (n_values,)."""
    values = pose[model.dof_value[limb.dofs], None]
    return float(np.mean(np.abs(model.limits[limb.dofs] - values).min(axis=1) < _LIMIT_RAD))


class _Contours(NamedTuple):
    """Visible contours of all parts, for the features of some of them."""

    costs: PartCosts
    far: Array
    """Summed distance to the edges, (V, n_parts), px times outlier distances."""
    beside_px: Array
    """Length seen from the side in one view, (n_parts,), px."""

    def forward(self, parts: IntArray | slice) -> float:
        """Return the feature `forward` of some parts."""
        return float(self.far[:, parts].sum()) / max(TINY, float(self.costs.length_px[:, parts].sum()))

    def explained(self, parts: IntArray | slice) -> float:
        """Return the feature `explained` of some parts."""
        length = float(self.costs.length_px[:, parts].sum())
        return float(self.costs.points[:, parts].sum()) / max(_MIN_LENGTH_PX, length)

    def second_forward(self, parts: IntArray, otherwise: float) -> float:
        """Return the feature `second_forward` of some parts, or another value where no view shows them."""
        shows = _shows(self.costs, self.beside_px, parts)
        forward = np.sort(self.far[:, parts].sum(axis=1)[shows] / self.costs.length_px[:, parts].sum(axis=1)[shows])
        return float(forward[max(0, len(forward) - 2)]) if len(forward) else otherwise


def classify(found: PoseQuality) -> Status:
    """Return the status of a pose."""
    odds = found.log_odds[:, None] + (LOST_NATS, 0.0)
    return "lost" if found.is_unseen else classify_limbs(odds)


def classify_limbs(odds: Array) -> Status:
    """Return the status of a pose from the log odds that its limbs are off and lost, (n_limbs, 2)."""
    off, lost = odds.max(axis=0, initial=-np.inf)
    return "lost" if lost > LOST_ODDS else "doubtful" if off > OFF_ODDS else "good"


def reason(found: PoseQuality) -> str:
    """Return the main reason against a pose, for people to read; empty where it is good."""
    if classify(found) == "good":
        return ""
    if found.views == 0:
        return "no view shows the body"
    if found.forward > _LOST_FORWARD:
        return "no edges near the body"
    return uncertain(found.limbs[int(found.log_odds.argmax())].name)


def status_named(name: str) -> Status:
    """Return the status of a name; "good" for a name of none."""
    statuses: tuple[Status, ...] = get_args(Status)
    return next((s for s in statuses if s == name), "good")


def worst(statuses: Sequence[Status]) -> Status:
    """Return the worst of several statuses; "good" for none."""
    return max(statuses, key=("good", "doubtful", "lost").index, default="good")


def _end_spreads(body: PosedBody, fit: Fit, ends: IntArray) -> Array:
    """Return the standard deviation of some points by a fit, (n_points,), metres."""
    model = body.model
    J = model.point_jacobian(body.kinematics, model.point_parts[ends], body.points_world[ends])
    return np.sqrt(np.trace(J @ covariance(model, fit) @ np.swapaxes(J, 1, 2), axis1=1, axis2=2))


_UNCERTAIN = " uncertain"
_MAY_BE_ELSEWHERE = " may be elsewhere"


def uncertain(limb: str, reason: str = "") -> str:
    """Return the remark that the limb of a name may be off, with the reason, such as ` without LEFT`."""
    return f"{limb_display_name(limb)}{_UNCERTAIN}{reason}"


def may_be_elsewhere(body: PosedBody, others: Sequence[Hypothesis]) -> str:
    """Return the remark that other poses, with limbs elsewhere than in the pose of a body, are about as good."""
    moved = {name for other in others for name in limbs_elsewhere(body, other.body)}
    names = [limb_display_name(limb.name) for limb in limbs(body.model) if limb.name in moved]
    return f"{' and '.join(names) or 'body'}{_MAY_BE_ELSEWHERE}"


def without_uncertainty(remark: str, alternatives: bool = False) -> list[str]:
    """Return the remarks that do not say that a limb may be off, nor that other poses are about as good.

    Args:
        remark: all, joined.
        alternatives: whether remarks on other poses are left out too.
    """
    left_out = (_UNCERTAIN, _MAY_BE_ELSEWHERE) if alternatives else (_UNCERTAIN,)
    return [r for r in remark.split(", ") if r and not any(words in r for words in left_out)]
