"""Read the markers of a capture system as a reference: joint centres, moved to the clock and the axes of a session.

Centres of joints from the landmarks around them, by published regressions.

Hips lie in the frame of the pelvis: its origin is midway between the anterior superior iliac spines, x points forward,
y up, z to the right. Knees, ankles, elbows and wrists are midpoints of the two landmarks across them. Radii of markers
and the thickness of the skin are not subtracted.
"""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from tracker.errors import FormatError
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.evaluation.markers.marker_set import LANDMARKS, HipRegression, read_marker_set
from tracker.evaluation.metrics import best_rigid
from tracker.evaluation.references import Reference, read_person
from tracker.formats.trc import MarkerTable
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.interchange.plausibility.body_likelihood import PRIORS
from tracker.interchange.plausibility.lags import find_lag

_MIN_OVERLAP = 0.5
"""Share of the poses that the markers cover at any lag that is tried."""
_N_PEAKS = 30
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
    lag_s = _lag(times, ours, table.times, theirs, 1 / estimate.rate)
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
    asked = [name for landmark in LANDMARKS for name in chosen.names(landmark)]
    table, _ = read_person(path, None, asked, "markers")
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


def _lag(times: Array, ours: Array, marker_times: Array, theirs: Array, frame_s: float) -> float:
    """Return the lag, s, at which two motions lie best over one another, whatever their axes.

    Speeds, which no axes change, correlate best at some lags. From each, the motions are laid over one another.

    Args:
        times: of the estimate, (F,), s; some frames may be missing.
        ours: its joints, (F, m, 3).
        marker_times: (n,), s.
        theirs: the same joints by markers, (n, m, 3).
        frame_s: time of a frame, s.

    Raises:
        FormatError: the markers cover too few poses at every lag, or the motion does not show the lag.
    """
    errors: dict[float, Array] = {}

    def distances(lag_s: float) -> Array:
        if lag_s not in errors:
            errors[lag_s] = _laid_over(_at(times + lag_s, marker_times, theirs), ours)
        return errors[lag_s]

    def distance_m(lag_s: float) -> float:
        known = np.isfinite(distances(lag_s))
        is_covered = np.any(known, axis=1).mean() >= _MIN_OVERLAP
        return float(np.median(distances(lag_s)[known])) if is_covered else np.inf

    bounds = [(start - frame_s, start + frame_s) for start in _starts(times, ours, marker_times, theirs, frame_s)]
    minima = [minimize_scalar(distance_m, bounds=b, method="bounded") for b in bounds]
    minima.sort(key=lambda f: f.fun)
    if not minima or not np.isfinite(minima[0].fun):
        raise FormatError(
            "expected markers over at least half of the tracked poses, found fewer at every lag; choose their recording"
        )
    best, n_rows = float(minima[0].x), PRIORS.posture_s / frame_s
    reach = int(np.ceil(n_rows))
    around = np.stack([distances(best + k * frame_s) for k in np.linspace(-reach, reach, 4 * reach + 1)])
    others = [float(f.x) for f in minima[1:] if abs(f.x - best) > PRIORS.posture_s and np.isfinite(f.fun)]
    rivals = [other for other in others if not _is_worse(distances(other), distances(best), n_rows)]
    if rivals or find_lag(around, reach, n_rows) is None:
        at = f" at {best:.2f} and {rivals[0]:.2f} s" if rivals else ""
        raise FormatError(
            "expected a motion that shows by how much the clocks of markers and cameras differ, found motions that are "
            f"alike at several lags{at}; compare a longer stretch, or one with faster motion"
        )
    return best


def _starts(times: Array, ours: Array, marker_times: Array, theirs: Array, frame_s: float) -> list[float]:
    """Return the lags, s, at which mean speeds correlate best: the highest of the local maxima."""
    apart = np.diff(times)
    step = float(np.median(apart))
    is_step = np.abs(apart - step) < frame_s / 2  # not across missing frames
    starts = times[:-1][is_step]
    speeds = _mean_lengths(np.diff(ours, axis=0)[is_step])
    grid = np.arange(marker_times[0], marker_times[-1] - step, frame_s)
    grid_speeds = _mean_lengths(_at(grid + step, marker_times, theirs) - _at(grid, marker_times, theirs))
    lags = np.arange(grid[0] - starts[-1], grid[-1] - starts[0] + frame_s, frame_s) if len(grid) else np.zeros(0)
    score = np.full(len(lags) + 2, -np.inf)
    for i, lag_s in enumerate(lags, 1):
        at = np.interp(starts + lag_s, grid, grid_speeds, left=np.nan, right=np.nan)
        known = np.isfinite(at) & np.isfinite(speeds)
        if known.mean() >= _MIN_OVERLAP:
            score[i] = _correlation(speeds[known], at[known])
    peaks = np.flatnonzero((score[1:-1] > score[:-2]) & (score[1:-1] >= score[2:]))
    return lags[peaks[np.argsort(-score[1:-1][peaks])][:_N_PEAKS]].tolist()


def _is_worse(errors: Array, best: Array, n_rows: float) -> bool:
    """Return whether distances, (F, m), are larger than the best by a paired t-test of independent stretches.

    Their squares saturate, as in `find_lag`: one stretch that is far off says no more than one that is off.
    """
    scale2 = (GROSS_SIGMAS * np.nanmedian(best)) ** 2
    rows = [_row_means(e**2 / (e**2 + scale2)) for e in (errors, best)]
    more = (rows[0] - rows[1])[np.isfinite(rows[0]) & np.isfinite(rows[1])]
    parts = np.array([part.mean() for part in np.array_split(more, max(1, round(len(more) / n_rows))) if len(part)])
    if len(parts) < 2:
        return False
    error = parts.std(ddof=1) / np.sqrt(len(parts))
    return bool(parts.mean() > np.sqrt(2 * CLEAR_NATS) * error)


def _row_means(values: Array) -> Array:
    """Return the mean of each row, (n, m), over what is known; NaN where nothing is."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=1)
    return np.asarray(np.where(known.any(axis=1), total / np.maximum(known.sum(axis=1), 1), np.nan))


def _mean_lengths(vectors: Array) -> Array:
    """Return the mean length of the vectors of each row, (n, m, 3), over those that are known."""
    return _row_means(np.linalg.norm(vectors, axis=-1))


def _correlation(a: Array, b: Array) -> float:
    spread = float(a.std() * b.std())
    return float(np.mean((a - a.mean()) * (b - b.mean()))) / spread if spread > 0 else 0.0


def _laid_over(moved: Array, ours: Array) -> Array:
    """Return the distances between points, (n, m), after the best rigid motion; NaN where one is missing."""
    return np.asarray(np.linalg.norm(rigid.apply(_rigid(moved, ours), moved) - ours, axis=-1))


def _at(wanted: Array, times: Array, points: Array) -> Array:
    """Return points, (n, m, 3), at other times, (k, m, 3), linearly; NaN beyond the ends and across gaps."""
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    apart = times[after] - times[after - 1]
    share = ((wanted - times[after - 1]) / apart)[:, None, None]
    is_gap = (np.rint(apart / np.median(np.diff(times))) > 1)[:, None, None]
    is_before, is_after = np.isclose(share, 0), np.isclose(share, 1)
    between = (1 - share) * points[after - 1] + share * points[after]
    resampled = np.where(is_after, points[after], np.where(is_before, points[after - 1], between))
    is_known = is_before | is_after | ((share > 0) & (share < 1) & ~is_gap)
    return np.asarray(np.where(is_known, resampled, np.nan))


def _rigid(moved: Array, ours: Array) -> Array:
    both = np.isfinite(moved).all(axis=-1) & np.isfinite(ours).all(axis=-1)
    return best_rigid(moved[both], ours[both]) if both.any() else np.eye(4)


_ACROSS = {
    "knee": ("lateral_epicondyle", "medial_epicondyle"),
    "ankle": ("lateral_malleolus", "medial_malleolus"),
    "elbow": ("lateral_elbow", "medial_elbow"),
    "wrist": ("radial_wrist", "ulnar_wrist"),
}
"""The landmarks between which a joint lies."""
_SHOULDER_SHARE = 0.104
"""Distance of the shoulder from the acromion towards the elbow, shares of the upper arm (de Leva 1996, J. Biomech. 29,
p. 1231)."""


_HIPS: Mapping[str, Mapping[str, Sequence[float]]] = tomllib.loads(
    Path(__file__).with_name("hips.toml").read_text("utf-8")
)
"""Regressions of hips."""


def joint_centres(landmarks: Mapping[str, Array], hips: HipRegression) -> dict[str, Array]:
    """Return the centres of the joints whose landmarks are there, (n, 3) each, metres.

    Args:
        landmarks: by name, as `marker_set.LANDMARKS` has them, (n, 3) each, metres; NaN where missing.
        hips: the regression for hips.
    """
    found = _hips(landmarks, _HIPS[hips])
    for side in ("left", "right"):
        for joint, ends in _ACROSS.items():
            names = [f"{side}_{end}" for end in ends]
            if landmarks.keys() >= {*names}:
                found[f"{side}_{joint}"] = (landmarks[names[0]] + landmarks[names[1]]) / 2
        acromion, elbow = landmarks.get(f"{side}_acromion"), found.get(f"{side}_elbow")
        if acromion is not None and elbow is not None:
            found[f"{side}_shoulder"] = acromion + _SHOULDER_SHARE * (elbow - acromion)
    return found


def _hips(landmarks: Mapping[str, Array], by: Mapping[str, Sequence[float]]) -> dict[str, Array]:
    left, right = landmarks.get("left_asis"), landmarks.get("right_asis")
    behind = [landmarks[name] for name in ("left_psis", "right_psis") if name in landmarks]
    back = sum(behind) / 2 if len(behind) == 2 else landmarks.get("sacrum")
    if left is None or right is None or back is None:
        return {}
    origin, across = (left + right) / 2, right - left
    width_m = np.linalg.norm(across, axis=1)
    depth_m = np.linalg.norm(origin - back, axis=1)
    z = across / width_m[:, None]
    forward = origin - back
    x = forward - np.sum(forward * z, axis=1)[:, None] * z
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(z, x)
    sizes = np.multiply.outer(depth_m, by["of_depth"]) + np.multiply.outer(width_m, by["of_width"]) + by["constant_m"]
    axes = np.stack([x, y, z], axis=1)  # (n, axis, 3)
    return {
        f"{side}_hip": origin + np.einsum("ni,nij->nj", sizes * (1.0, 1.0, sign), axes)
        for side, sign in (("right", 1.0), ("left", -1.0))
    }
