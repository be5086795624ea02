"""A search around the pose of a person on a frame: the entry that trackers make, stores keep, and pages show."""

from math import isfinite
from typing import Literal, NamedTuple

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
