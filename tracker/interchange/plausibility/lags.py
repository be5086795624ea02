"""Find by how many frames motions that should be one lie apart, and how far that is known."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.geometry.arrays import Array, Mask
from tracker.interchange.observations.checks import vertex


class Lag(NamedTuple):
    """By how many frames of the session a recording is later than points of it."""

    best: float
    """The likeliest one, between frames."""
    low: int
    high: int
    """First and last lag that may be right."""

    @property
    def frames(self) -> int:
        """The lag in whole frames; 0 if they may be in step."""
        return 0 if self.low <= 0 <= self.high else round(self.best)

    def __str__(self) -> str:
        """Return words such as "3 frames later (2 to 5)"."""
        n, ends = abs(self.frames), sorted(map(abs, (self.low, self.high)))
        known = "" if ends == [n, n] else f" ({ends[0]} to {ends[1]})"
        return f"{n} frame{'s' * (n != 1)} {'later' if self.frames > 0 else 'earlier'}{known}"


def combined_lag(found: Sequence[Lag | None]) -> Lag | None:
    """Return the lag that no kind of evidence excludes, likeliest by the one that limits it most; None without one."""
    known = [lag for lag in found if lag is not None]
    low, high = max((lag.low for lag in known), default=0), min((lag.high for lag in known), default=-1)
    if low > high:
        return None
    best = min(known, key=lambda lag: lag.high - lag.low).best
    return Lag(float(np.clip(best, low, high)), low, high)


def find_lag(errors: Array, reach: float, n_rows: float) -> Lag | None:
    """Find the lag with the least errors; None if these do not limit it on both sides.

    Errors count as squares that saturate (Geman-McClure), in units of their median at the best lag. A lag is excluded
    if its costs are larger than the best by a paired t-test: t^2 / 2 nats, as of normal means, `CLEAR_NATS` and the
    logarithm of the number of lags that were tried.

    Args:
        errors: of evenly spaced lags, (n_lags, F, n), those of lag 0 in the middle; NaN where unknown.
        reach: the last lag, frames.
        n_rows: number of rows after which errors are independent of those before.
    """
    return _find_lag(errors, np.linspace(-reach, reach, len(errors)), n_rows, 0)


def _find_lag(errors: Array, lags: Array, n_rows: float, n_tried: int) -> Lag | None:
    """Find the lag as `find_lag` does; those around the best are compared again on the rows that they share.

    Args:
        errors: of the lags.
        lags: frames, evenly spaced.
        n_rows: see `find_lag`.
        n_tried: number of lags of which these are around the best; 0 for all.
    """
    known: Mask = np.all(np.isfinite(errors), axis=0)
    if not known.any():
        return None
    scale = GROSS_SIGMAS * max(np.median(errors[:, known], axis=1).min(), np.finfo(float).tiny ** 0.5)
    costs = np.where(known, errors**2 / (errors**2 + scale**2), 0.0)
    mean = costs.sum(axis=(1, 2))
    best, middle = int(mean.argmin()), len(mean) // 2
    if not n_tried:  # the middle, which is no lag, is compared too
        width = max(abs(best - middle) + 1, middle // 2)
        near = slice(max(best - width, 0), best + width + 1)
        return _find_lag(errors[near], lags[near], n_rows, len(errors))
    rows_known, cells = np.flatnonzero(np.any(known, axis=1)), list[Array]()
    for rows in np.array_split(rows_known, max(1, round(len(rows_known) / n_rows))):
        n_known = np.sum(known[rows], axis=0)
        cells.append(costs[:, rows].sum(axis=1)[:, n_known > 0] / n_known[n_known > 0])
    more = np.concatenate(cells, axis=1)
    more -= more[best]
    if more.shape[1] < 2:
        return None
    least = np.sqrt(2 * (CLEAR_NATS + np.log(n_tried or len(more))) / more.shape[1]) * more.std(axis=1, ddof=1)
    likely = np.flatnonzero(more.mean(axis=1) <= least)
    if likely[0] == 0 or likely[-1] == len(more) - 1:
        return None
    at = lags[best] + (lags[1] - lags[0]) * vertex(-mean[best - 1 : best + 2])
    return Lag(float(at), int(lags[likely[0]]), int(lags[likely[-1]]))
