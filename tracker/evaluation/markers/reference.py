"""Read the markers of a capture system as a reference: joint centres, moved to the clock and the axes of a session."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from tracker.errors import FormatError
from tracker.evaluation.markers.joint_centres import joint_centres
from tracker.evaluation.markers.marker_set import LANDMARKS, read_marker_set
from tracker.evaluation.metrics import best_rigid
from tracker.evaluation.references import Reference
from tracker.formats.joint_tables.subjects import by_subject
from tracker.formats.trc import MarkerTable
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.interchange.observations.readers import FORMATS, SPACE_FORMATS, find_files
from tracker.interchange.plausibility.body_likelihood import PRIORS
from tracker.interchange.plausibility.lags import find_lag

_MIN_OVERLAP = 0.5
"""Share of the poses that the markers cover at any lag that is tried."""
_N_PEAKS = 5
"""Number of lags, the likeliest by speed, at which motions are laid over one another."""


class MarkerReference(NamedTuple):
    """A reference from markers."""

    reference: Reference
    """Joint centres at the frames of the session, in its axes."""
    lag_s: float
    """Time of the markers at frame 0 of the session, s."""
    T_world_markers: Array
    """From the axes of the markers to those of the session, (4, 4)."""


def read_marker_reference(path: Path, marker_set: str, estimate: MarkerTable) -> MarkerReference:
    """Read markers, and lay the motion of their joint centres over that of an estimate.

    Args:
        path: file of markers, such as C3D or TRC.
        marker_set: name of the set, or its TOML file.
        estimate: joints of stored poses at frames of the session, whose rate is that of its frames.

    Raises:
        FormatError: the file or the set is malformed, the file has several people or too few markers of the set, or
            the motions are too short or too still to show by how much the clocks differ.
    """
    if len(estimate.frames) < 3:
        raise FormatError(
            f"expected tracked poses to compare markers with, found {len(estimate.frames)}; track the recording first"
        )
    table = read_centres(path, marker_set)
    shared = [name for name in table.names if name in estimate.names]
    theirs = table.points[:, [table.names.index(name) for name in shared]]
    ours = estimate.points[:, [estimate.names.index(name) for name in shared]]
    times = estimate.frames / estimate.rate
    lag_s = _lag(times, ours, table.times, theirs)
    at = times + lag_s
    moved = _at(at, table.times, theirs)
    T = _rigid(moved, ours)
    points = rigid.apply(T, _at(at, table.times, table.points))
    angle = np.degrees(np.arccos(np.clip((np.trace(T[:3, :3]) - 1) / 2, -1, 1)))
    note = (
        f"the markers lie at {lag_s:+.3f} s of the session's frames, and turned by {angle:.1f} degrees; both were "
        "found by the motion, so that a constant shift of all joints is not an error"
    )
    placed = MarkerTable(
        table.names, estimate.frames, times, points, estimate.rate, notes=(*table.notes, note), person=table.person
    )
    return MarkerReference(Reference(placed, None), lag_s, T)


def read_centres(path: Path, marker_set: str) -> MarkerTable:
    """Read the markers of one person, and return the centres of his joints at the markers' times.

    Raises:
        FormatError: see `read_marker_reference`.
    """
    chosen = read_marker_set(marker_set)
    layout, files = find_files([path])
    if layout not in SPACE_FORMATS:
        found = f"{FORMATS[layout].program} file {path}"
        raise FormatError(f"expected markers in space, found the {found}; choose another file")
    asked = [name for landmark in LANDMARKS for name in chosen.names(landmark)]
    read = SPACE_FORMATS[layout].read([file for file, _ in files], None, None)
    tables = [own for _, table in read for own in by_subject(table, asked)]
    if len(tables) != 1:
        raise FormatError(f"{path}: expected the markers of one person, found those of {len(tables)}; keep one in it")
    (table,) = tables
    column = {name: i for i, name in enumerate(table.names)}
    landmarks = {
        landmark: table.points[:, column[name]]
        for landmark in LANDMARKS
        for name in [next((n for n in chosen.names(landmark) if n in column), None)]
        if name is not None
    }
    centres = joint_centres(landmarks, chosen.hips)
    if len(centres) < 3:
        missing = [
            names[0] for landmark in LANDMARKS if landmark not in landmarks and (names := chosen.names(landmark))
        ]
        raise FormatError(
            f"{path}: expected markers of the set {marker_set} for three joints or more, found those for "
            f"{len(centres)}; it lacks {', '.join(missing[:6])}; choose another set, or write its names to a TOML file"
        )
    points = np.stack(list(centres.values()), axis=1)
    return MarkerTable(
        tuple(centres), table.frames, table.times, points, table.rate, notes=table.notes, person=table.person
    )


def _lag(times: Array, ours: Array, marker_times: Array, theirs: Array) -> float:
    """Return the lag, s, at which two motions lie best over one another, whatever their axes.

    Speeds, which no axes change, correlate best at some lags. From each, the motions are laid over one another.
    """
    step = float(np.median(np.diff(times)))
    grid = np.arange(marker_times[0], marker_times[-1] + step / 2, step)
    speeds = _speeds(_at(times, times, ours), step), _speeds(_at(grid, marker_times, theirs), step)
    n_least = int(np.ceil(_MIN_OVERLAP * len(speeds[0])))
    scored = []
    for shift in range(n_least - len(speeds[0]), len(speeds[1]) - n_least + 1):
        first, last = max(0, -shift), min(len(speeds[0]), len(speeds[1]) - shift)
        if last - first >= max(n_least, 3):
            scored.append((_correlation(speeds[0][first:last], speeds[1][first + shift : last + shift]), shift))
    starts = [grid[0] - times[0] + shift * step for _, shift in sorted(scored, reverse=True)[:_N_PEAKS]]

    def distance_m(lag_s: float) -> float:
        errors = _laid_over(_at(times + lag_s, marker_times, theirs), ours)
        known = np.isfinite(errors)
        return float(np.median(errors[known])) if known.sum() >= n_least else np.inf

    found = [
        minimize_scalar(distance_m, bounds=(start - step, start + step), method="bounded", options={"xatol": step / 50})
        for start in starts
    ]
    best = min(found, key=lambda f: f.fun, default=None)
    if best is None or not np.isfinite(best.fun):
        raise FormatError(
            "expected markers over at least half of the tracked poses, found fewer at every lag; choose their recording"
        )
    reach = int(np.ceil(PRIORS.posture_s / step))
    around = best.x + step * np.linspace(-reach, reach, 4 * reach + 1)
    errors = np.stack([_laid_over(_at(times + lag_s, marker_times, theirs), ours) for lag_s in around])
    if find_lag(errors, reach, reach) is None:
        raise FormatError(
            "expected a motion that shows by how much the clocks of markers and cameras differ, found motions that are "
            "alike at many lags; compare a stretch with faster motion"
        )
    return float(best.x)


def _laid_over(moved: Array, ours: Array) -> Array:
    """Return the distances between points, (n, m), after the best rigid motion; NaN where one is missing."""
    return np.asarray(np.linalg.norm(rigid.apply(_rigid(moved, ours), moved) - ours, axis=-1))


def _at(wanted: Array, times: Array, points: Array) -> Array:
    """Return points, (n, m, 3), at other times, (k, m, 3), linearly; NaN beyond the ends and beside gaps."""
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    share = (wanted - times[after - 1]) / (times[after] - times[after - 1])
    share = np.where((share < -1e-9) | (share > 1 + 1e-9), np.nan, share)[:, None, None]
    return np.asarray((1 - share) * points[after - 1] + share * points[after])


def _speeds(points: Array, step_s: float) -> Array:
    """Return the mean speed of all points between rows, (n - 1,), m/s; 0 where none is known."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1) / step_s
    known = np.isfinite(steps)
    return np.where(known, steps, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)


def _correlation(a: Array, b: Array) -> float:
    spread = float(a.std() * b.std())
    return float(np.mean((a - a.mean()) * (b - b.mean()))) / spread if spread > 0 else 0.0


def _rigid(moved: Array, ours: Array) -> Array:
    both = np.isfinite(moved).all(axis=-1) & np.isfinite(ours).all(axis=-1)
    return best_rigid(moved[both], ours[both]) if both.any() else np.eye(4)
