"""Lengths between the limb joints of a person in any pose, as a survey or a rig states them."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from tracker.errors import TrackerError
from tracker.geometry.arrays import Array

SEGMENTS: Mapping[str, Sequence[tuple[Sequence[str], Sequence[str]]]] = {
    **{
        name: [([f"left_{a}"], [f"left_{b}"]), ([f"right_{a}"], [f"right_{b}"])]
        for name, a, b in (
            ("upper arm", "shoulder", "elbow"),
            ("forearm", "elbow", "wrist"),
            ("thigh", "hip", "knee"),
            ("calf", "knee", "ankle"),
        )
    },
    **{f"{g} width": [([f"left_{g}"], [f"right_{g}"])] for g in ("shoulder", "hip")},
    "trunk": [(["left_shoulder", "right_shoulder"], ["left_hip", "right_hip"])],
}
"""Pairs of ends, the middles of some joints, whose distance is a length; left and right are one."""


def segment_lengths(places: Mapping[str, Array], names: Collection[str] = tuple(SEGMENTS)) -> dict[str, float]:
    """Return the median length of some of `SEGMENTS` over frames and sides, metres.

    Args:
        places: position of each limb joint, (3,) or (T, 3), metres; NaN where unknown.
        names: of the segments, by default all.

    Raises:
        TrackerError: a joint is missing, or both ends of a segment are known on no frame.
    """
    return {name: _length(places, name, SEGMENTS[name]) for name in names}


def _length(places: Mapping[str, Array], name: str, pairs: Sequence[tuple[Sequence[str], Sequence[str]]]) -> float:
    """Return the median length between pairs of ends, metres."""
    missing = [j for pair in pairs for end in pair for j in end if j not in places]
    if missing:
        raise TrackerError(f"fitting sizes needs the joint '{missing[0]}', found {', '.join(places)}")
    gaps = [np.mean([places[j] for j in a], axis=0) - np.mean([places[j] for j in b], axis=0) for a, b in pairs]
    lengths = np.linalg.norm(np.concatenate([np.atleast_2d(g) for g in gaps]), axis=1)
    known = lengths[np.isfinite(lengths)]
    if not len(known):
        raise TrackerError(f"fitting sizes needs a frame in which both ends of the {name} are known, found none")
    return float(np.median(known))
