"""The model behind the statuses: fit it, leave one body out, and count what its statuses are worth."""

import itertools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from tracker.estimation.tracking.confidence import Status, classify_limbs, probabilities, worst
from tracker.geometry.arrays import Array

OFF_MM, LOST_MM = 100.0, 150.0
"""A limb is off, and lost, where the error of a joint is larger."""
UNSEARCHED_WEIGHT = 0.3
"""Weight of a limb that was tracked without search, where more is lost."""
TWO_CAMERAS_WEIGHT = 0.2
"""Weight of a limb that two cameras saw. Errors along the line of sight leave no trace in any feature, and the weights
would follow them instead of what more cameras show."""
RIDGE = 3e-3
LOST_GOAL, OFF_GOAL = 0.95, 0.05
"""Smallest share of the lost frames that are flagged, and largest share of the good frames that are off."""


class LimbRows(NamedTuple):
    """The limbs of all frames of one or several runs, one row each."""

    features: Array
    """See `confidence.features`, (n, 8)."""
    error_mm: Array
    """Largest error of a joint of the limb, of the head for a head, (n,)."""
    worst_mm: Array
    """Largest error of a limb joint of the person in the frame, (n,)."""
    person: NDArray[np.int64]
    """Index of the person in the recording, (n,)."""
    frame: NDArray[np.int64]
    """Number of the frame, (n,)."""
    unseen: NDArray[np.bool_]
    """Whether no edge is near the body, (n,)."""
    alternatives: NDArray[np.bool_]
    """Whether other poses are about as good, (n,)."""


class Run(NamedTuple):
    """One recording tracked in one way."""

    recording: str
    bodies: tuple[str, ...]
    """Name of each person's body."""
    condition: str
    """What differs from four cameras with backgrounds at the full frame rate; empty where nothing does."""
    body: str
    """`generic` or `acquired`."""
    searched: bool
    """Whether lost limbs were searched."""
    rows: LimbRows


class Counts(NamedTuple):
    """What the statuses of some frames are worth."""

    frames: int = 0
    lost: int = 0
    lost_flagged: int = 0
    good: int = 0
    good_off: int = 0
    flagged: int = 0
    flagged_fine: int = 0

    def plus(self, other: "Counts") -> "Counts":
        """Return the sum."""
        return Counts(*(a + b for a, b in zip(self, other, strict=True)))


class Statuses(NamedTuple):
    """Statuses of the final poses of a run, one for each person and frame."""

    status: NDArray[np.str_]
    worst_mm: Array
    person: NDArray[np.int64]
    odds: Array
    """Highest log odds of a limb that it is off."""

    def counts(self, of: NDArray[np.bool_] | None = None) -> Counts:
        """Count the frames of some persons; of all by default."""
        flagged, worst = self.status != "good", self.worst_mm
        if of is not None:
            flagged, worst = flagged[of], worst[of]
        lost, off = worst > LOST_MM, worst > OFF_MM
        sums = (lost, lost & flagged, ~flagged, ~flagged & off, flagged, flagged & ~off)
        return Counts(len(worst), *(int(x.sum()) for x in sums))


def save_rows(path: Path, rows: LimbRows) -> None:
    """Write rows to an .npz file."""
    np.savez_compressed(path, **rows._asdict())


def load_rows(path: Path) -> LimbRows:
    """Read rows that `save_rows` wrote."""
    with np.load(path) as found:
        return LimbRows(**{name: found[name] for name in LimbRows._fields})


def weights_of(run: Run) -> Array:
    """Return the weight of each row of a run in the fit, (n,); 0 where the error is unknown."""
    weight = 1.0 if run.searched else UNSEARCHED_WEIGHT
    weight *= TWO_CAMERAS_WEIGHT if run.condition == "2 cameras" else 1.0
    return np.where(np.isfinite(run.rows.error_mm) & ~run.rows.unseen, weight, 0.0)


def fit_weights(features: Array, error_mm: Array, weights: Array) -> Array:
    """Fit the weights of the features and the constants of both thresholds, (n_features + 2,).

    Both thresholds share the weights (proportional odds), so that a limb is never more likely lost than off.

    Args:
        features: (n, n_features).
        error_mm: (n,).
        weights: of the rows, (n,).
    """
    used = weights > 0
    X, w = features[used], weights[used] / weights.sum()
    above = np.stack([error_mm[used] > OFF_MM, error_mm[used] > LOST_MM], axis=1)
    middle, spread = X.mean(axis=0), X.std(axis=0) + 1e-9
    Z, n = (X - middle) / spread, X.shape[1]

    def loss(b: Array) -> tuple[float, Array]:
        odds = (Z @ b[:n])[:, None] + b[n:]
        value = float(w @ (np.logaddexp(0, odds) - above * odds).sum(axis=1) + RIDGE * b[:n] @ b[:n])
        residual = w[:, None] * (probabilities(odds) - above)
        return value, np.append(Z.T @ residual.sum(axis=1) + 2 * RIDGE * b[:n], residual.sum(axis=0))

    b = minimize(loss, np.zeros(n + 2), jac=True, method="L-BFGS-B", options={"maxiter": 2000}).x
    scaled = b[:n] / spread
    return np.append(scaled, b[n:] - scaled @ middle)


def fitted(runs: Sequence[Run], without: str | None = None) -> Array:
    """Fit to all rows of some runs, without those of one body."""
    parts = [(r.rows, weights_of(r) * _is_other(r, without)) for r in runs]
    return fit_weights(
        np.concatenate([rows.features for rows, _ in parts]), np.concatenate([rows.error_mm for rows, _ in parts]),
        np.concatenate([w for _, w in parts]),
    )  # fmt: skip


def _is_other(run: Run, without: str | None) -> NDArray[np.bool_]:
    """Return whether each row is of another body, (n,)."""
    return np.array([body != without for body in run.bodies])[run.rows.person]


def held_out_odds(runs: Sequence[Run]) -> list[Array]:
    """Return the log odds of off and lost for each row of each run, (n, 2), fitted to all other bodies."""
    names = sorted({body for run in runs for body in run.bodies})
    models = {name: fitted(runs, without=name) for name in names}
    out = []
    for run in runs:
        odds = np.empty((len(run.rows.frame), 2))
        for person, body in enumerate(run.bodies):
            own = run.rows.person == person
            odds[own] = odds_by(models[body], run.rows.features[own])
        out.append(odds)
    return out


def odds_by(weights: Array, features: Array) -> Array:
    """Return the log odds of off and lost, (n, 2), by weights and constants as `fit_weights` returns them."""
    return np.asarray((features @ weights[:-2])[:, None] + weights[-2:])


def statuses(rows: LimbRows, odds: Array) -> Statuses:
    """Return the statuses of the final poses by log odds of off and lost, (n, 2)."""
    out: list[tuple[str, float, int, float]] = []
    for own in _by_frame(rows):
        i = own[0]
        called = _status(odds[own], rows.unseen[i], rows.alternatives[i])
        out.append((called, float(rows.worst_mm[i]), int(rows.person[i]), float(odds[own, 0].max())))
    return Statuses(*(np.array(column) for column in zip(*out, strict=True)))


def _status(odds: Array, unseen: bool, alternatives: bool) -> Status:
    """Return the status from the odds of the limbs of a person, (n_limbs, 2), as a finished run does."""
    status: Status = "lost" if unseen else classify_limbs(odds)
    return worst([status, "doubtful"]) if alternatives else status


def least_fine(found: Sequence[Statuses]) -> tuple[float, float]:
    """Return what the best threshold for some frames would reach while it meets the other two goals.

    Args:
        found: the frames. The threshold is that of the probability that a limb is off.

    Returns:
        The share of the flagged frames that are fine, and the share of all frames that are flagged.
    """
    odds, worst = (np.concatenate([getattr(s, name) for s in found]) for name in ("odds", "worst_mm"))
    off, lost = ((worst > limit)[np.argsort(-odds, kind="stable")] for limit in (OFF_MM, LOST_MM))
    flagged = np.arange(len(odds) + 1)
    n_off, n_lost = (np.append(0, np.cumsum(x)) for x in (off, lost))
    meets = (n_lost >= LOST_GOAL * n_lost[-1]) & (n_off[-1] - n_off <= OFF_GOAL * (len(odds) - flagged))
    best = int(flagged[meets][np.argmin((1 - n_off / np.maximum(flagged, 1))[meets] * (flagged[meets] > 0))])
    return (best - int(n_off[best])) / max(1, best), best / len(odds)


def first_off(found: Sequence[Statuses], shares: Sequence[float]) -> list[float]:
    """Return which share of the frames that are likeliest off is off, for each share of all frames."""
    odds, worst = (np.concatenate([getattr(s, name) for s in found]) for name in ("odds", "worst_mm"))
    off = (worst > OFF_MM)[np.argsort(-odds, kind="stable")]
    return [float(off[: max(1, round(share * len(off)))].mean()) for share in shares]


def _by_frame(rows: LimbRows) -> Iterable[NDArray[np.int64]]:
    """Yield the rows of each person and frame."""
    keys = rows.person * (int(rows.frame.max(initial=0)) + 1) + rows.frame
    order = np.argsort(keys, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(keys[order])) + 1)


def summed(counts: Iterable[Counts]) -> Counts:
    """Return the sum of some counts."""
    total = Counts()
    for one in counts:
        total = total.plus(one)
    return total


def reliability(
    probabilities: Array, happened: NDArray[np.bool_], edges: Sequence[float]
) -> list[tuple[float, float, int]]:
    """Return the mean probability, the share that happened and the number of rows between each two edges."""
    out = []
    for low, high in itertools.pairwise(edges):
        own = (probabilities >= low) & (probabilities < high)
        if own.any():
            out.append((float(probabilities[own].mean()), float(happened[own].mean()), int(own.sum())))
    return out


def pooled(runs: Sequence[Run], odds: Sequence[Array], keep: Callable[[Run], bool]) -> tuple[Array, Array]:
    """Return the probabilities of off and lost, (n, 2), and the errors, (n,), of the limbs of some runs."""
    chosen = [(r.rows, o) for r, o in zip(runs, odds, strict=True) if keep(r)]
    use = [np.isfinite(rows.error_mm) & ~rows.unseen for rows, _ in chosen]
    given = np.concatenate([probabilities(o[u]) for (_, o), u in zip(chosen, use, strict=True)])
    return given, np.concatenate([rows.error_mm[u] for (rows, _), u in zip(chosen, use, strict=True)])
