"""Two people face to face: their turn about each other, and the positions of their hands."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.simulate.motion.choreography import SIDES, Choreography, Track
from tracker.simulate.motion.postures import Posture, Reach

TANGO_TURN_S = 2.4
"""Duration of a whole turn: 60 frames at 25 frames a second."""
TANGO_APART_M = 0.31
"""Distance between the middles of the trunks, which leaves a hand's breadth between the bodies."""
COUPLE_APART_M: Mapping[str, float] = MappingProxyType(
    {"apart": 1.5, "near": 0.7, "touching": 0.45, "overlapping": 0.25}
)
"""Distances between the middles of the trunks. The hands touch at 0.7 m; the trunks are pressed together at 0.25 m."""

_ASIDE_M = 0.05
"""Sideways shift of each person to the own left, so that the feet of close people have room beside each other."""
_STANCE_M = 0.49
"""Smallest distance of the feet of people who lean on each other, metres."""
_LEAN_RAD = np.radians(4.0)
_CLASP_M, _PALM_M = 0.088, 0.15
"""Distance from the wrist to the contact of two hands, clasped and palm to palm."""
_PERFORMANCE_S = 60.0
_PATH_KEY_S = 0.04
_BEFORE_S = 2.0
"""Duration of the steps before the footage begins, so that the feet already follow the turn."""

Turn = Callable[[float], float]
Reaches = Mapping[str, Reach]


@dataclass(frozen=True, eq=False)
class Partner:
    """One of two people who turn about the point between them."""

    steps: Choreography
    """Motion of trunk and legs; its time is `_BEFORE_S` ahead."""
    turn: Turn
    """Turn of the couple at a time, left about the vertical, rad."""
    reaches: Callable[[float], Reaches]
    """Targets of the arms at a time, in the couple's frame: the man stands at negative x and faces along x."""

    def act(self, model: BodyModel, t: float) -> Posture:
        """Return the posture at a time in seconds."""
        R_place_couple = rigid.so3_exp(np.array([0.0, 0.0, self.turn(t)]))
        reaches = {
            side: Reach(tuple(R_place_couple @ wrist), tuple(R_place_couple @ elbow_to))
            for side, (wrist, elbow_to) in self.reaches(t).items()
        }
        return replace(self.steps.act(model, t + _BEFORE_S), reaches=reaches)


def tango(man_m: float, woman_m: float) -> tuple[Partner, Partner]:
    """Dance in a close hold, turning once in `TANGO_TURN_S`.

    His right arm is round her back below her left, which lies over it with the hand on his shoulder; his left hand
    holds her right at the height of her shoulder.

    Args:
        man_m: his body height, metres.
        woman_m: hers.
    """
    half = 0.5 * TANGO_APART_M

    def turn(t: float) -> float:
        return 2 * np.pi * t / TANGO_TURN_S

    def joined_hands(t: float) -> tuple[float, float]:
        """Return the sideways position and the height of the joined hands."""
        return 0.505 + _wave(t, 0.03, 2.1), 0.812 * woman_m + _wave(t, 0.05, 1.5)

    def his(t: float) -> Reaches:
        aside, height = joined_hands(t)
        back = (half + 0.075, -0.215, 0.748 * woman_m + _wave(t, 0.012, 1.7))
        return {
            "right": Reach(back, (-0.45, -1.0, -0.45)),
            "left": Reach((-_CLASP_M, aside, height), (-0.3, 0.2, -1.0)),
        }

    def hers(t: float) -> Reaches:
        aside, height = joined_hands(t)
        return {
            "left": Reach((0.080 - half, -0.185, 0.842 * man_m), (0.15, -1.0, -0.1)),
            "right": Reach((_CLASP_M, aside, height), (0.3, 0.2, -1.0)),
        }

    return _partners(TANGO_APART_M, turn, 0.30, his, hers)


def couple(apart_m: float, seed: int) -> tuple[Partner, Partner]:
    """Turn slowly, face to face at a distance, with all arms waving; near enough, palm to palm.

    Args:
        apart_m: distance of the middles of the trunks, metres.
        seed: of pace and phase.
    """
    rng = np.random.default_rng([seed, 16])
    turn_s = rng.uniform(6.0, 9.0) * rng.choice((-1.0, 1.0))
    periods_s, phases = rng.uniform(1.5, 2.3, (2, 2)), rng.uniform(0.0, 2 * np.pi, (2, 2))
    ahead = min(max(0.5 * apart_m - _PALM_M, 0.05), 0.25)

    def turn(t: float) -> float:
        return 2 * np.pi * t / turn_s

    def waving(t: float, toward: float) -> Reaches:
        """Return the reaches of the person who faces along x (`toward` 1) or against it (-1)."""
        reaches = {}
        for i, at_left in enumerate((1.0, -1.0)):
            aside, up = np.sin(2 * np.pi * t / periods_s[i] + phases[i])
            wrist = (toward * (ahead - 0.5 * apart_m), at_left * (0.44 - 0.25 * ahead + 0.06 * aside), 1.25 + 0.15 * up)
            side = SIDES[i] if toward > 0 else SIDES[1 - i]
            reaches[side] = Reach(wrist, (-0.3 * toward, 0.7 * at_left, -1.0))
        return reaches

    return _partners(apart_m, turn, 0.36, lambda t: waving(t, 1.0), lambda t: waving(t, -1.0))


def _partners(
    apart_m: float, turn: Turn, step_s: float, his: Callable[[float], Reaches], hers: Callable[[float], Reaches]
) -> tuple[Partner, Partner]:
    """Place two people's trunks at a distance; closer than their feet have room for, they lean on each other."""
    lean_m = max(0.0, 0.5 * (_STANCE_M - apart_m))
    out = 0.5 * apart_m + lean_m
    aside = _ASIDE_M if apart_m < 2 * _STANCE_M else 0.0
    man = _circling(turn, (-out, aside, 0.0), 0.018, lean_m, step_s)
    woman = _circling(turn, (out, -aside, np.pi), 0.014, lean_m, step_s)
    return Partner(man, turn, his), Partner(woman, turn, hers)


def _circling(
    turn: Turn, place: tuple[float, float, float], depth: float, lean_m: float, step_s: float
) -> Choreography:
    """Keep a position and heading in the couple's frame, x, y of the feet and yaw, while the couple turns."""
    times = np.arange(0.0, _PERFORMANCE_S, _PATH_KEY_S)
    x, y, yaw = place
    angles = np.array([turn(t - _BEFORE_S) for t in times])
    c, s = np.cos(angles), np.sin(angles)
    still = np.zeros(1)
    return Choreography(
        arms={},
        path=Track(times, np.stack([c * x - s * y, s * x + c * y, yaw + angles], axis=1), _evenly),
        crouch=Track(still, np.array([[depth, _LEAN_RAD if lean_m else 0.0]])),
        lifts=Track(still, np.zeros((1, 2))),
        sway_hz=0.0,
        step_s=step_s,
        step_height_m=0.035,
        # Bending the trunk moves the hips back.
        ahead_m=lean_m + (0.016 if lean_m else 0.0),
    )


def _evenly(t: float, start: float, end: float) -> float:
    """Rise linearly from 0 to 1 between two times."""
    return (t - start) / (end - start)


def _wave(t: float, amplitude: float, period_s: float) -> float:
    return amplitude * float(np.sin(2 * np.pi * t / period_s))
