"""The limbs of a body: chains of parts that are assessed and searched together.

`Search` is the entry of a search around a pose, which trackers make, stores keep, and pages show.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import isfinite
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel

BENT_RAD = float(np.radians(20.0))
"""Bend of an elbow or knee from which it determines the twist of its limb, rad: the wrist then lies a third of the
forearm's length beside the line of the upper arm."""


class Limb(NamedTuple):
    """A chain of parts that can be lost independently of the rest."""

    name: str
    """Name of its last part."""
    parts: NDArray[np.int64]
    """Indices of its parts, from the trunk outwards."""
    dofs: NDArray[np.bool_]
    """The degrees of freedom of its joints, (n_dofs,)."""


@lru_cache(maxsize=32)
def limbs(model: BodyModel) -> tuple[Limb, ...]:
    """Return the chains from the leaves of the joint tree up to where it branches."""
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


def movable(some: Sequence[Limb], active_dofs: NDArray[np.bool_] | None) -> list[Limb]:
    """Return limbs with their active degrees of freedom alone, (n_dofs,); None: all. Limbs without any are left out."""
    if active_dofs is None:
        return list(some)
    restricted = [limb._replace(dofs=limb.dofs & active_dofs) for limb in some]
    return [limb for limb in restricted if limb.dofs.any()]


def display_name(name: str) -> str:
    """Format the name of a part, joint or degree of freedom for display: "left shoulder abduction"."""
    return name.replace("_", " ").replace(".", " ")


def limb_display_name(limb: str) -> str:
    """Format the name of a limb for display: `left_forearm` or `left_hand`, its last part, gives "left arm"."""
    for part, whole in _LIMBS.items():
        limb = limb.replace(part, whole)
    return display_name(limb)


_LIMBS = {"forearm": "arm", "hand": "arm", "calf": "leg", "foot": "leg"}
"""Limbs of people by the name of their last part."""


SearchKind = Literal["limbs", "exchange", "body", "samples", "path", "repair"]
"""Limbs elsewhere; two limbs exchanged; the whole body best first; samples along the covariance; limbs elsewhere
by all frames of a run together; limbs elsewhere by the colours of the run."""


class Search(NamedTuple):
    """One search, and its result."""

    kind: SearchKind
    limbs: tuple[str, ...]
    """Names of the limbs that were searched; empty where the whole body was."""
    before_nats: float
    """Cost of the pose before the search, up to a constant that all searches of one entry share."""
    after_nats: float | None
    """Cost of the best other pose; None where no other was about as good."""
    taken: bool
    """Whether that pose took the place of the one before."""

    @classmethod
    def of(cls, kind: SearchKind, limbs: tuple[str, ...], before: float, after: float | None, taken: bool) -> "Search":
        """Return an entry with rounded costs: a tenth of a nat is a tenth of the odds."""
        nats = None if after is None or not isfinite(after) else round(float(after), 1)
        return cls(kind, limbs, round(float(before), 1), nats, bool(taken))
