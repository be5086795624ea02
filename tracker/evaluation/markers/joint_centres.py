"""Centres of joints from the landmarks around them, by published regressions.

Hips lie in the frame of the pelvis: its origin is midway between the anterior superior iliac spines, x points forward,
y up, z to the right. Knees, ankles, elbows and wrists are midpoints of the two landmarks across them. Radii of markers
and the thickness of the skin are not subtracted.
"""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tracker.evaluation.markers.marker_set import HipRegression
from tracker.geometry.arrays import Array

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
