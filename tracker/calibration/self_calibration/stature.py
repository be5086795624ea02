"""Scale of the world by the stature of a person, and a world that stands on the person's floor."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.errors import CalibrationError, TrackerError
from tracker.estimation.acquisition.segment_lengths import segment_lengths
from tracker.estimation.acquisition.size_parameters import SizePriors, typical_body
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

_SEGMENTS = ("calf", "thigh", "trunk")
"""Lengths that add up to most of a stature."""
_FEET = {"heels and toes": ("heel", "toe"), "ankles": ("ankle",)}
"""Points that a floor is found by, best first."""
_BODY = "gavrila38"


STATURE_SIGMA = 0.062
"""Root mean square distance of adult statures from that of a typical adult (`DEFAULT_HEIGHT_M`), as a share of it: men
of 1.756 +- 0.069 m and as many women of 1.629 +- 0.064 m (ANSUR II, Gordon et al. 2014)."""


class Upright(NamedTuple):
    """A world with z up whose origin lies on the floor below the person."""

    cameras: tuple[Camera, ...]
    joints_world: Array
    """(F, N, 3), metres."""
    lean_rad: float
    """Median angle between the vertical and the direction from the ankles to the shoulders, or from the feet to the
    crown, on a frame."""
    floor_by: str
    """Points that the floor was found by."""


def metres_per_unit(joints: Array, names: Sequence[str], statures_m: Sequence[float]) -> float:
    """Return the factor from the unit of joints to metres, for people of some statures in typical proportions.

    It is the geometric mean of those of the people whose segments were all seen.

    Args:
        joints: of all people, one after the other, (F, n_people * J, 3), in any unit; NaN where unknown.
        names: point of the body that each joint of a person is, (J,).
        statures_m: of each person, metres; NaN for one who does not count.

    Raises:
        CalibrationError: a segment was seen of nobody.
    """
    scales = metres_by_person(joints, names, statures_m)
    if not np.isfinite(scales).any():
        raise CalibrationError(
            "expected the shoulders, hips, knees and ankles of the person in two views, found too few; film the whole "
            "person, who moves"
        )
    return float(np.exp(np.nanmean(np.log(scales))))


def metres_by_person(joints: Array, names: Sequence[str], statures_m: Sequence[float]) -> Array:
    """Return the factor from the unit of joints to metres by each person, (n_people,); NaN where it is not seen.

    Arguments are those of `metres_per_unit`.
    """
    own = joints.reshape(len(joints), len(statures_m), len(names), 3)
    return np.array([_factor(own[:, p], names, s) if np.isfinite(s) else np.nan for p, s in enumerate(statures_m)])


def _factor(joints: Array, names: Sequence[str], stature_m: float) -> float:
    """Return the factor for one person, whose joints are (F, J, 3); NaN where a segment was not seen.

    Calves, thighs and trunk are compared with those of a body of this stature, by their median lengths over the frames.
    """
    body = typical_body(load_model(_BODY, stature_m))
    expected = segment_lengths(body.named_points_world(body.neutral()), _SEGMENTS)
    try:
        found = segment_lengths({name: joints[:, i] for i, name in enumerate(names) if name}, _SEGMENTS)
    except TrackerError:
        return np.nan
    return sum(expected.values()) / sum(found.values())


def scale_sigma(stature_m: float | None, n_people: int = 1) -> float:
    """Return the standard deviation of `metres_per_unit` as a share of it; of a typical adult's stature without one.

    Lengths of people of one stature differ by `SizePriors.length`, each in its own way, and statures without knowledge
    differ from person to person.
    """
    body = load_model(_BODY)
    lengths = np.array([*segment_lengths(body.named_points_world(body.neutral()), _SEGMENTS).values()])
    of_proportions = SizePriors().length * float(np.linalg.norm(lengths) / lengths.sum())
    return float(np.hypot(of_proportions, STATURE_SIGMA if stature_m is None else 0.0) / np.sqrt(n_people))


def upright(cameras: Sequence[Camera], joints: Array, names: Sequence[str], stature_m: float) -> Upright:
    """Turn a world so that z points from the ankles to the shoulders, and put its origin on the floor.

    The first camera looks along y, apart from its tilt. The floor is as high as the lower foot of a frame is, by the
    median of all frames; ankles stand above it as far as those of a body.

    Args:
        cameras: in any world, metres.
        joints: (F, N, 3), metres.
        names: point of the body that each joint is.
        stature_m: of the person, metres.

    Raises:
        CalibrationError: too little of the person was seen.
    """
    places = {name: joints[:, i] for i, name in enumerate(names) if name}
    spines = _middle(places, "shoulder") - _middle(places, "ankle")
    spines = spines[np.isfinite(spines).all(axis=1)]
    if not len(spines):
        raise CalibrationError("expected ankles and shoulders in one frame, found none; film the whole person")
    turn, lean = _upwards(cameras, spines)
    turned = rigid.apply(turn, joints)
    below, floor_by = _lowest(dict(zip(names, np.moveaxis(turned, 1, 0), strict=True)), stature_m)
    return _on_floor(cameras, turn, turned, below, lean, floor_by)


def upright_by_ends(cameras: Sequence[Camera], ends: Array, points: Array) -> Upright:
    """Turn a world so that z points from the feet to the crown, and put its origin on the floor below the person.

    Args:
        cameras: in any world, metres.
        ends: crown and feet, (F, 2, 3), metres; NaN where unknown.
        points: others to take along, (F, N, 3), metres.
    """
    turn, lean = _upwards(cameras, ends[:, 0] - ends[:, 1])
    below = float(np.nanmedian(rigid.apply(turn, ends[:, 1])[:, 2]))
    return _on_floor(cameras, turn, rigid.apply(turn, points), below, lean, "feet of the silhouettes")


def _upwards(cameras: Sequence[Camera], spines: Array) -> tuple[Array, float]:
    """Return the turn to a world in which spines, (F, 3), point up, and their median angle from its vertical.

    The first camera looks along y, apart from its tilt.
    """
    spines = spines[np.isfinite(spines).all(axis=1)]
    up = np.median(spines / np.linalg.norm(spines, axis=1, keepdims=True), axis=0)
    up /= np.linalg.norm(up)
    lean = float(np.median(np.arccos(np.clip(spines @ up / np.linalg.norm(spines, axis=1), -1.0, 1.0))))
    forward = cameras[0].T_world_camera[:3, 2] - up * float(up @ cameras[0].T_world_camera[:3, 2])
    if not np.linalg.norm(forward):  # it looks straight down
        forward = cameras[0].T_world_camera[:3, 1]
    forward = forward / np.linalg.norm(forward)
    turn = rigid.transform(np.stack([np.cross(forward, up), forward, up]), None)
    return turn, lean


def _on_floor(
    cameras: Sequence[Camera], turn: Array, turned: Array, below: float, lean: float, floor_by: str
) -> Upright:
    """Return a turned world with its origin on the floor below points, (F, N, 3)."""
    middle = np.nanmedian(turned.reshape(-1, 3), axis=0)
    origin = np.array([middle[0], middle[1], below])
    world = rigid.transform(None, -origin) @ turn
    moved = tuple(replace(c, T_world_camera=world @ c.T_world_camera) for c in cameras)
    return Upright(moved, turned - origin, lean, floor_by)


def _middle(places: Mapping[str, Array], joint: str) -> Array:
    """Return the mean of the left and the right joint, (F, 3); NaN where either is unknown."""
    nowhere = np.full((1, 3), np.nan)
    return np.asarray(places.get(f"left_{joint}", nowhere) + places.get(f"right_{joint}", nowhere)) / 2


def _lowest(places: Mapping[str, Array], stature_m: float) -> tuple[float, str]:
    """Return the height of the floor, and the points that it was found by."""
    body = load_model(_BODY, stature_m)
    own = body.named_points_world(body.neutral())
    for title, points in _FEET.items():
        feet = [places[f"{side}_{p}"][:, 2] for side in ("left", "right") for p in points if f"{side}_{p}" in places]
        heights = np.array(feet or [[np.nan]])
        known = np.isfinite(heights).any(axis=0)
        if known.any():
            above = own["left_ankle"][2] - own["left_heel"][2] if points == ("ankle",) else 0.0
            return float(np.median(np.nanmin(heights[:, known], axis=0)) - above), title
    raise CalibrationError("expected feet in two views, found none; film the whole person")
