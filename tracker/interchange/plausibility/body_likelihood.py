"""The log likelihood that points in space are the joints of a person, by bones and posture.

Each term compares a person with points of anything, in nats for one posture, averaged over frames. A share of joints is
grossly wrong (`PeoplePriors.gross`), so that no single one decides.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from tracker.estimation.acquisition.segment_lengths import SEGMENTS
from tracker.estimation.acquisition.size_parameters import SizePriors, typical_body
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.lengths import USUAL_SIZES


class PeoplePriors(NamedTuple):
    """Numbers that are usual of people, and of points by which programs find them."""

    gross: float = 0.1
    """Share of joints that are grossly wrong: between those of a network of a slow person (3%) and of a fast one
    (25%)."""
    error: float = 0.02
    """Standard deviation of a joint of another program from that of a body, share of its height: 3 cm of a network."""
    log_range: float = 4.6
    """Range of the logarithm of a length between points of anything: from 2 cm to 2 m."""
    lean_rad: float = 0.3
    """Standard deviation of the lean of a person who stands, walks or sits, rad."""
    impossible: float = -10.0
    """Log likelihood ratio of a stature that nobody has, nats: far below those of people."""
    height_sigmas: float = 3.0
    """Standard deviations by which heights differ at most from those that a session states, usually."""
    posture_s: float = 0.5
    """Time after which a posture is another one, seconds: that of a step."""
    postures: float = 10.0
    """Number of postures from which on their common offsets count more than their number."""
    parts: int = 4
    """Parts that are independent evidence in each view: forearms and calves."""
    in_step: int = 1
    """Frames by which points may be late without a question: as much as numbers from 0 or 1 and filters make."""
    stretch_s: float = 2.0
    """Shortest stretch of a motion that is looked at, seconds: two steps of each leg."""
    most_off: float = 0.5
    """Share of the limbs, by truncated squares of distances, from which people are not those of the recording."""


PRIORS = PeoplePriors()
_BODY, _PERSON = "gavrila38", USUAL_SIZES["person"]
_usual_body = cache(lambda stature_m: typical_body(load_model(_BODY, stature_m)))
"""Return the body of typical proportions for a stature, metres."""
_SEGMENTS = {
    **SEGMENTS,
    "foot": [(["left_ankle"], ["left_toe"]), (["right_ankle"], ["right_toe"])],
    "heel": [(["left_ankle"], ["left_heel"]), (["right_ankle"], ["right_heel"])],
}
_DIRECTIONS = (
    ("hip", "knee", "ankle", True, True),
    ("shoulder", "elbow", "wrist", False, False),
    ("ankle", "toe", "ankle", True, True),
)
"""Joints before, at and after each joint, whether it lies ahead of the line of the others or behind it, and whether
that is sure: an arm may be turned. Toes lie ahead of the ankle."""

Places = Mapping[str, Array]
"""Positions of points of the body by name, (F, 3) each; NaN where unknown."""


class Bones(NamedTuple):
    """Lengths of the bones of a person."""

    nats: float
    """Log likelihood ratio of a person against points of anything, for one posture; 0 without any bone."""
    stature: float
    """Height of a body with these lengths, in the unit of the points; NaN without any bone."""
    oddest: str = ""
    """Name of the segment that fits a person least."""
    lengths: tuple[float, float] = (np.nan, np.nan)
    """Its lengths in 80% of the frames, in the unit of the points."""
    is_of_person: bool = True
    """Whether no segment is grossly wrong on most frames."""


def bones(places: Places) -> Bones:
    """Compare the distances between neighbouring joints with those of a body of the stature that fits them.

    Their logarithms are normal around those of typical proportions, with the spread of people (`SizePriors`) and of
    joints. Constancy and symmetry follow, because each frame and each side counts.
    """
    known = {
        (name, i): np.linalg.norm(_middle(places, a) - _middle(places, b), axis=-1)
        for name, pairs in _SEGMENTS.items()
        for i, (a, b) in enumerate(pairs)
        if places.keys() >= {*a, *b}
    }
    known = {key: lengths for key, lengths in known.items() if np.isfinite(lengths).any()}
    if not known:
        return Bones(0.0, np.nan)
    logs = np.log(np.maximum([*known.values()], TINY))
    stature = usual = np.ones(1)
    for _ in range(2):  # a child has other proportions
        body = _usual_body(round(float(np.clip(stature, *_PERSON).item()), 2))
        own = body.named_points_world(body.neutral())
        lengths = {n: np.linalg.norm(_middle(own, a) - _middle(own, b)) for n, ((a, b), *_) in _SEGMENTS.items()}
        usual = np.log([lengths[name] / body.height_m for name, _ in known])[:, None]
        stature = np.exp(np.nanmedian(logs - usual))
    priors = SizePriors()
    of_joints = np.sqrt(2) * np.hypot(priors.joint, PRIORS.error) / np.exp(usual)
    ratios = PRIORS.log_range * _density(logs - usual - np.log(stature), np.hypot(priors.length, of_joints))
    nats = np.nanmean(np.log((1 - PRIORS.gross) * ratios + PRIORS.gross), axis=1)
    oddest = int(nats.argmin())
    low, high = np.nanquantile(np.exp(logs[oddest]), (0.1, 0.9))
    is_of_person = bool(nats[oddest] > 0.5 * np.log(PRIORS.gross))
    return Bones(float(nats.sum()), float(stature), [*known][oddest][0], (float(low), float(high)), is_of_person)


def stature_nats(stature_m: float, expected_m: float) -> float:
    """Return the log likelihood ratio of a stature, against one of any order of magnitude.

    Args:
        stature_m: of the points, metres.
        expected_m: that the session states, metres: of a child as of an adult, it is usually about right.
    """
    if np.isnan(stature_m):
        return 0.0
    near = _density(np.log(np.array(stature_m / expected_m)), SizePriors().height)
    anyone = _PERSON.has(stature_m) / np.log(_PERSON.high / _PERSON.low)
    density = (1 - PRIORS.gross) * near + PRIORS.gross * anyone
    return float(np.log(max(PRIORS.log_range * density, np.exp(PRIORS.impossible))))


def upright_nats(places: Places, up: Array) -> float:
    """Return the log likelihood ratio of a person who stands, walks or sits upright.

    Args:
        places: points of the person.
        up: direction of the vertical, (3,).
    """
    lower = next((j for j in ("ankle", "knee", "hip") if _has(places, j)), None)
    if lower is None or not _has(places, "shoulder"):
        return 0.0
    spine = _middle(places, _both("shoulder")) - _middle(places, _both(lower))
    with np.errstate(invalid="ignore", divide="ignore"):
        lean = np.arccos(np.clip(spine @ up / np.linalg.norm(spine, axis=-1), -1.0, 1.0))
    # On the sphere, normal in the lean: its density against that of any direction, 1 / (4 pi).
    ratios = 2.0 / PRIORS.lean_rad**2 * np.exp(-0.5 * (lean / PRIORS.lean_rad) ** 2)
    return _mean(np.log((1 - PRIORS.gross) * ratios + PRIORS.gross))


@np.errstate(invalid="ignore", divide="ignore")
def bend_nats(places: Places) -> float:
    """Return the log likelihood ratio of knees, elbows and feet that point the right way; they do not if mirrored."""
    from scipy.special import ndtr  # imported lazily: loading takes 0.1 s

    if not (_has(places, "shoulder") and _has(places, "hip")):
        return 0.0
    up = _middle(places, _both("shoulder")) - _middle(places, _both("hip"))
    left = sum(places[f"left_{j}"] - places[f"right_{j}"] for j in ("shoulder", "hip"))
    forward = np.cross(left, up)
    forward = forward / np.linalg.norm(forward, axis=-1, keepdims=True)
    height, total = np.linalg.norm(up, axis=-1), 0.0
    for side in ("left", "right"):
        for before, at, after, is_ahead, is_sure in _DIRECTIONS:
            names = [f"{side}_{j}" for j in (before, at, after)]
            if not places.keys() >= set(names):
                continue
            a, b, c = (places[n] for n in names)
            line = c - a
            along = np.sum((b - a) * line, axis=-1) / np.sum(line * line, axis=-1)
            foot = a + np.nan_to_num(along)[:, None] * line
            # The trunk is 30% of the height.
            ahead = np.sum((b - foot) * forward, axis=-1) / (PRIORS.error * height / 0.3)
            wrong = PRIORS.gross if is_sure else 3 * PRIORS.gross
            total += _mean(np.log(2 * (1 - wrong) * ndtr(ahead if is_ahead else -ahead) + wrong))
    return total


def _density(deviations: Array, sigma: Array | float) -> Array:
    """Return the normal density of deviations; scipy.stats has it, but takes 0.8 s to load."""
    return np.exp(-((deviations / sigma) ** 2) / 2) / (np.sqrt(2 * np.pi) * sigma)


def _has(places: Places, joint: str) -> bool:
    return places.keys() >= set(_both(joint))


def _both(joint: str) -> list[str]:
    return [f"left_{joint}", f"right_{joint}"]


def _middle(places: Places, names: Sequence[str]) -> Array:
    return np.mean([places[n] for n in names], axis=0)


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else 0.0
