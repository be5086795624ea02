"""Choreographies of one person, composed from moves by a seed."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from tracker.geometry.arrays import Array
from tracker.simulate.motion.choreography import SIDES, Choreography, Track, glide
from tracker.simulate.motion.postures import ramp

ARM_KEYS: Mapping[str, tuple[float, float, float, float]] = MappingProxyType(
    {
        "rest": (8, -3, 0, 14),
        "side": (92, 0, 0, 8),
        "up": (160, 12, 0, 14),
        "front": (4, 92, 0, 7),
        "back": (16, -45, 0, 12),
        "open": (24, 42, -8, 55),
        "guard": (12, 32, -14, 138),
        "punch": (2, 86, -10, 6),
        "head": (88, 38, 6, 128),
        "hip": (52, -12, -70, 84),
        "belly": (5, 27, -84, 96),
        "chest": (-4, 41, -80, 110),
        "shoulder": (-10, 55, -66, 130),
        "swing ahead": (10, 32, 4, 48),
        "swing behind": (12, -26, 4, 16),
    }
)
"""Key postures of an arm: shoulder abduction, elevation, twist, elbow extension, degrees."""
_TUCKED = ("hip", "belly", "chest", "shoulder")
"""Postures close to the trunk."""
_BEYOND_TRUNK = (*_TUCKED, "back", "swing behind")
"""Between one of these and a posture close to the trunk an arm opens, or it would pass through the body."""
_SPREAD_DEG = (4.0, 4.0, 4.0, 5.0)
_BOUNDS_DEG = ((-20.0, -55.0, -95.0, 2.0), (172.0, 150.0, 60.0, 145.0))
_HIP_TURN_RAD = np.radians(58.0)
"""Largest turn of the trunk over a standing foot."""
_PERFORMANCE_S = 60.0

Move = tuple[str, float, float]
"""Key posture, time to get there, time to stay there, seconds."""

_EXERCISES: tuple[tuple[Move, ...], ...] = (
    (("side", 0.45, 0.05), ("up", 0.4, 0.1)),
    (("front", 0.45, 0.0), ("up", 0.4, 0.0), ("side", 0.35, 0.0), ("rest", 0.4, 0.0)),
    (("chest", 0.5, 0.2),),
    (("guard", 0.4, 0.05), ("punch", 0.24, 0.02), ("guard", 0.24, 0.05), ("punch", 0.24, 0.02)),
    (("back", 0.4, 0.0), ("front", 0.5, 0.05)),
    (("belly", 0.45, 0.2),),
)


def exercise(seed: int) -> Choreography:
    """All limbs through large ranges: arms raised, circled, crossed, boxing; knees lifted, squats, turns with steps."""
    rng = np.random.default_rng([seed, 11])
    order = list(range(len(_EXERCISES)))
    orders = [order if seed == 0 and not i else rng.permutation(len(_EXERCISES)) for i in range(8)]
    left = [move for order in orders for i in order for move in _EXERCISES[i]]
    # The moves of both arms are alike in boxing and crossing, but offset in time.
    right = left if seed % 2 == 0 else left[3:] + left[:3]
    trunk = _Trunk(rng)
    while trunk.time_s < _PERFORMANCE_S:
        trunk.lift(rng.uniform(0.13, 0.24))
        trunk.turn(rng.uniform(40.0, 100.0))
        trunk.lift(rng.uniform(0.13, 0.24))
        trunk.crouch(rng.uniform(0.07, 0.13), rng.uniform(5.0, 16.0), 1.2)
        trunk.step(rng.uniform(0.1, 0.3), 0.9)
    return trunk.with_arms({"left": _arm(rng, left), "right": _arm(rng, right)})


def dance(seed: int) -> Choreography:
    """Move the arms quickly, turn the body half round and back, with small steps."""
    rng = np.random.default_rng([seed, 12])
    keys = ("up", "side", "front", "chest", "back", "head", "guard", "open", "belly")
    scores = {
        side: [(str(rng.choice(keys)), rng.uniform(0.28, 0.42), rng.uniform(0.0, 0.06)) for _ in range(160)]
        for side in SIDES
    }
    trunk = _Trunk(rng, step_s=0.3)
    while trunk.time_s < _PERFORMANCE_S:
        trunk.turn(rng.uniform(150.0, 190.0))
        trunk.crouch(rng.uniform(0.02, 0.06), rng.uniform(0.0, 15.0), 0.5)
        trunk.step(rng.uniform(0.1, 0.25), 0.6)
    return trunk.with_arms({side: _arm(rng, score) for side, score in scores.items()})


def reach_and_cross(seed: int) -> Choreography:
    """Cross the arms before the trunk at real speed, rest them against it, then reach out again."""
    rng = np.random.default_rng([seed, 13])
    scores: dict[str, list[Move]] = {side: [] for side in SIDES}
    for score in scores.values():
        for _ in range(60):
            score.append((str(rng.choice(_TUCKED)), rng.uniform(0.3, 0.5), rng.uniform(0.25, 0.8)))
            reached = str(rng.choice(("front", "side", "open", "rest", "up")))
            score.append((reached, rng.uniform(0.3, 0.5), rng.uniform(0.0, 0.25)))
    trunk = _Trunk(rng)
    while trunk.time_s < _PERFORMANCE_S:
        trunk.stand(rng.uniform(0.5, 1.0))
        trunk.turn(rng.uniform(20.0, 60.0))
        trunk.crouch(rng.uniform(0.0, 0.04), rng.uniform(5.0, 22.0), 1.2)
    return trunk.with_arms({side: _arm(rng, score) for side, score in scores.items()})


def leaving(seed: int) -> Choreography:
    """Walk into a corner of the room, out of the image of some cameras, and back."""
    rng = np.random.default_rng([seed, 14])
    corner = float(np.radians((13.0, -77.0, 103.0, -167.0)[seed % 4]))  # from the actor's heading
    swing: list[Move] = [("swing ahead", 0.42, 0.0), ("swing behind", 0.42, 0.0)] * 70
    trunk = _Trunk(rng, step_s=0.32)
    trunk.face(corner)
    while trunk.time_s < _PERFORMANCE_S:
        far, pace_s = rng.uniform(1.9, 2.25), rng.uniform(1.6, 1.8)
        for _ in ("there", "back"):
            trunk.walk(far, pace_s)
            trunk.turn(180.0)
    return trunk.with_arms({"left": _arm(rng, swing), "right": _arm(rng, swing[1:])})


def mingling(seed: int, home: tuple[float, float, float]) -> Choreography:
    """Gesture with bent arms and turn to and fro among others, who may stand as near as a metre.

    Args:
        seed: of the motion.
        home: x, y in the frame of the actor's place, metres, and the heading, rad.
    """
    rng = np.random.default_rng([seed, 15])
    keys = ("rest", "open", "guard", "head", "hip", "belly", "chest", "shoulder", "swing ahead")
    scores = {
        side: [(str(rng.choice(keys)), rng.uniform(0.4, 0.6), rng.uniform(0.0, 0.2)) for _ in range(120)]
        for side in SIDES
    }
    trunk = _Trunk(rng, home=home)
    while trunk.time_s < _PERFORMANCE_S:
        trunk.turn(rng.uniform(30.0, 80.0))
        trunk.lift(rng.uniform(0.08, 0.16))
        trunk.crouch(rng.uniform(0.02, 0.08), rng.uniform(0.0, 8.0), 0.9)
        trunk.step(rng.uniform(0.02, 0.06), 0.6)
    return trunk.with_arms({side: _arm(rng, score) for side, score in scores.items()})


class _Trunk:
    """Records the motion of trunk and legs, one action after the other."""

    def __init__(
        self, rng: np.random.Generator, step_s: float = 0.36, home: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        self.time_s = 0.15
        self._rng, self._step_s = rng, step_s
        self._turned, self._lifted = (int(i) for i in rng.integers(2, size=2))
        self._home = self._place = np.array(home)
        self._keys = {
            name: [(0.0, start)]
            for name, start in (("path", self._home), ("crouch", np.zeros(2)), ("lifts", np.zeros(2)))
        }

    def stand(self, duration_s: float) -> None:
        """Let time pass."""
        self.time_s += duration_s

    def turn(self, degrees: float) -> None:
        """Turn on the spot with steps, alternately there and back."""
        self._turned = 1 - self._turned
        self.face(self._place[2] + (1 - 2 * self._turned) * np.radians(degrees))

    def face(self, yaw_rad: float) -> None:
        """Turn on the spot with steps to a yaw, turned left from ahead, as fast as the hips allow."""
        x, y, yaw = self._place
        self._go((x, y, yaw_rad), max(0.3, 1.5 * abs(yaw_rad - yaw) * self._step_s / _HIP_TURN_RAD))

    def step(self, length_m: float, duration_s: float) -> None:
        """Step to a place near home."""
        angle = self._rng.uniform(0.0, 2 * np.pi)
        x, y = self._home[:2] + length_m * np.array([np.cos(angle), np.sin(angle)])
        self._go((x, y, self._place[2]), duration_s)

    def walk(self, length_m: float, duration_s: float) -> None:
        """Walk straight ahead."""
        x, y, yaw = self._place
        self._go((x + length_m * np.cos(yaw), y + length_m * np.sin(yaw), yaw), duration_s)

    def crouch(self, depth: float, bend_deg: float, duration_s: float) -> None:
        """Bend the knees, fraction of body height, and the trunk, and straighten them again."""
        self._there_and_back("crouch", np.array([depth, np.radians(bend_deg)]), duration_s)

    def lift(self, height: float) -> None:
        """Lift a knee, the foot by a fraction of body height; alternately left and right."""
        # The feet come to rest last.
        self.time_s = max(self.time_s, self._keys["path"][-1][0] + 1.5 * self._step_s)
        self._lifted = 1 - self._lifted
        self._there_and_back("lifts", height * np.eye(2)[self._lifted], 0.95)

    def with_arms(self, arms: Mapping[str, Track]) -> Choreography:
        """Combine the recorded motion with that of the arms."""
        path, crouch, lifts = (
            Track(np.array([t for t, _ in keys]), np.array([v for _, v in keys]), glide if name == "path" else ramp)
            for name, keys in self._keys.items()
        )
        sway_hz = float(self._rng.uniform(0.4, 0.8))
        return Choreography(arms, path, crouch, lifts, sway_hz, self._step_s)

    def _go(self, place: tuple[float, float, float], duration_s: float) -> None:
        pace = self._rng.uniform(0.9, 1.15)
        self._keys["path"].append((self.time_s, self._place))
        self._place = np.array(place)
        self.time_s += pace * duration_s
        self._keys["path"].append((self.time_s, self._place))

    def _there_and_back(self, name: str, values: Array, duration_s: float) -> None:
        pace = self._rng.uniform(0.9, 1.15)
        keys = self._keys[name]
        for share, value in ((0.0, 0.0), (0.45, 1.0), (0.55, 1.0), (1.0, 0.0)):
            keys.append((self.time_s + share * pace * duration_s, value * values))
        self.time_s += pace * duration_s + 0.05


def _arm(rng: np.random.Generator, score: Sequence[Move]) -> Track:
    """Return the keys of one arm; a seed varies angles and pace a little."""
    times, angles_deg, before = [0.0, 0.1], [np.array(ARM_KEYS["rest"])] * 2, "rest"
    for key, move_s, stay_s in score:
        if key != before and {key, before} <= set(_BEYOND_TRUNK) and {key, before} & set(_TUCKED):
            times.append(times[-1] + 0.3)
            angles_deg.append(np.array(ARM_KEYS["open"]))
        pace = rng.uniform(0.85, 1.2)
        reached = np.clip(np.array(ARM_KEYS[key]) + rng.normal(0.0, _SPREAD_DEG), *_BOUNDS_DEG)
        times += [times[-1] + pace * move_s, times[-1] + pace * (move_s + max(stay_s, 1e-3))]
        angles_deg += [reached, reached]
        before = key
    return Track(np.array(times), np.radians(np.array(angles_deg)))
