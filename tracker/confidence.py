"""How sure a tracker is of a pose: what the evidence says of it, and a status by rules.

The rules were set on simulated footage, where the error is known (`tests/benchmarks/calibrate_status.py`), and are
checked on other scenes.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance import ColorScore, PartColors
from tracker.body import BodyModel
from tracker.evidence import SCENE_SPACING_PX
from tracker.fit import Fit, covariance
from tracker.refine import PartCosts
from tracker.rigid import Array

Status = Literal["good", "doubtful", "lost"]

_LEAST_SAMPLES = 12
"""Colours of fewer samples say nothing about a part."""
_LEAST_TRUST = 0.5
"""Silhouettes trusted less have no say."""
_MOST_UNEXPLAINED = 0.035
"""A silhouette of whose contour more than this is explained by no part shows a limb that is elsewhere."""
_LEAST_SHOWN = 0.15
"""A limb of whose outline less than this is visible in all views together hides somewhere."""


class Limb(NamedTuple):
    """A chain of parts that can be lost by itself."""

    name: str
    """Name of its last part."""
    parts: NDArray[np.int64]
    """Indices of its parts, from the trunk outwards."""
    dofs: NDArray[np.bool_]
    """The degrees of freedom of its joints, (n_dofs,)."""


class LimbFigures(NamedTuple):
    """What the evidence says of one limb."""

    name: str
    forward: float
    """Mean cut-off distance to the edges of the part that is worst off, in outlier distances."""
    shown: float
    """Visible outline of the part that shows most, as a share of what it would show in the open."""
    color: float
    """Colours under the part that is worst off: how much likelier on this part than elsewhere, nats per sample."""
    drop: float
    """How much less that is than where the colours were learnt, nats per sample."""

    @property
    def suspicious(self) -> bool:
        """Whether they speak against the limb's pose."""
        return self.forward > 0.45 or self.shown < _LEAST_SHOWN or (self.drop > 0.6 and self.color < 0.2)


class Quality(NamedTuple):
    """What the evidence says of a pose. Distances are in outlier distances."""

    forward: float
    """Mean cut-off distance of the visible contour to the edges."""
    explained: float
    """Edge points explained, per visible contour of the same length."""
    spread_m: float
    """Largest standard deviation of the end of a limb, metres."""
    step_m: float
    """Largest way of a limb's end from where it was predicted, metres."""
    views: int
    """Views that see the body."""
    unexplained: float
    """Share of the silhouette's contour that no part explains, in the second worst of the trusted views."""
    limbs: tuple[LimbFigures, ...]
    """The same limb by limb."""

    @property
    def suspects(self) -> tuple[str, ...]:
        """Names of the limbs that their figures speak against; all where the image shows what no part explains."""
        everyone = self.unexplained > _MOST_UNEXPLAINED
        return tuple(x.name for x in self.limbs if everyone or x.suspicious)


@lru_cache(maxsize=32)
def limbs(model: BodyModel) -> tuple[Limb, ...]:
    """The chains from the leaves of the joint tree up to where it branches."""
    children = np.bincount(np.array(model.parents)[1:], minlength=len(model.parts))
    out = []
    for leaf in np.flatnonzero(children == 0):
        chain, part = [int(leaf)], model.parents[leaf]
        while part > 0 and children[part] == 1:
            chain.append(part)
            part = model.parents[part]
        dofs = np.isin(model.dof_joint, chain)
        if chain != [0] and dofs.any():
            out.append(Limb(model.parts[leaf].name, np.array(chain[::-1]), dofs))
    return tuple(out)


def quality(
    model: BodyModel,
    fit: Fit,
    predicted: Array,
    costs: PartCosts,
    thetas_px: Array,
    open_px: Array,
    trusts: Array,
    colors: tuple[ColorScore, PartColors] | None,
) -> Quality:
    """Sum up what speaks for and against a pose.

    Args:
        model: the body.
        fit: the pose, and the normal matrix there.
        predicted: where it was expected, (n_values,).
        costs: of its parts.
        thetas_px: outlier distance of each view, (V,), matched px.
        open_px: length of outline that each part would show in each view in the open, (V, n_parts), matched px.
        trusts: how far the silhouette of each view is trusted, (V,), 0 to 1; 0 where there is none.
        colors: of its parts; None where there are none.
    """
    length, chains = costs.length_px.sum(axis=0), limbs(model)
    far = np.nansum(costs.forward_px / thetas_px[:, None] * costs.length_px, axis=0)
    shown = length / np.maximum(open_px.sum(axis=0), 1e-9)
    forward = np.where(shown >= _LEAST_SHOWN, far / np.maximum(length, 1e-9), 0.0)
    color, drop = np.full(len(model.parts), np.inf), np.zeros(len(model.parts))
    if colors is not None:
        score, known = colors
        seen = score.samples >= _LEAST_SAMPLES
        color, drop = np.where(seen, score.parts, np.inf), np.where(seen, known.usual - score.parts, 0.0)
    ends = np.array([np.flatnonzero(model.point_parts == c.parts[-1])[-1] for c in chains], dtype=np.int64)
    J = _jacobian(model, fit.values, ends)
    cov = J @ covariance(model, fit) @ np.swapaxes(J, 1, 2)
    step = np.linalg.norm((model.points_world(fit.values) - model.points_world(predicted))[ends], axis=-1)
    return Quality(
        float(far.sum() / max(1e-9, length.sum())),
        float(SCENE_SPACING_PX * costs.points.sum() / max(1e-9, length.sum())),
        float(np.sqrt(np.trace(cov, axis1=1, axis2=2).max(initial=0.0))),
        float(step.max(initial=0.0)),
        int(np.count_nonzero(costs.length_px.sum(axis=1) > 0)),
        _second_largest(1.0 - costs.outline[trusts > _LEAST_TRUST]),
        tuple(
            LimbFigures(
                c.name, float(forward[c.parts].max()), float(shown[c.parts].max()), float(color[c.parts].min()),
                float(drop[c.parts].max()),
            )
            for c in chains
        ),
    )  # fmt: skip


def _second_largest(shares: Array) -> float:
    """What at least two views say; 0 where there are fewer."""
    return float(np.sort(shares)[-2]) if len(shares) > 1 else 0.0


def judge(found: Quality) -> Status:
    """Good, doubtful or lost."""
    if found.views == 0 or found.forward > 0.6:
        return "lost"
    return "doubtful" if found.suspects else "good"


def worst(statuses: Sequence[Status]) -> Status:
    """The worst of several."""
    return max(statuses, key=("good", "doubtful", "lost").index, default="good")


def _jacobian(model: BodyModel, values: Array, points: NDArray[np.int64]) -> Array:
    """Derivative of some of the body's points, (n, 3, n_dofs)."""
    kinematics = model.kinematics(values)
    return model.point_jacobian(kinematics, model.point_parts[points], model.points_world(values)[points])
