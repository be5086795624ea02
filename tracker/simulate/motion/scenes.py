"""The scenes that can be simulated, and the roles in them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.geometry import rigid
from tracker.simulate.motion.couples import COUPLE_APART_M, Partner, couple, tango
from tracker.simulate.motion.postures import Posture, Role, ramp, stance, standing_height
from tracker.simulate.motion.solo_moves import dance, exercise, leaving, mingling, reach_and_cross
from tracker.simulate.people.builds import MAN, WOMAN
from tracker.simulate.people.outfit import BLACK_AND_WHITE, GREEN, RED, Outfit
from tracker.simulate.people.population import individual


def elbow_rotation(model: BodyModel, t: float) -> Posture:
    """Raise both arms sideways to 90 degrees, rotate both elbows forward, and back again (GD96 Fig. 8).

    The trunk leans back against the arms and turns a little; the knees bend slightly.
    """
    t = t % 4.4
    up = ramp(t, 0.05, 0.95) - ramp(t, 3.25, 4.25)
    forward = ramp(t, 0.95, 1.85) - ramp(t, 2.3, 3.2)
    sway = np.sin(2 * np.pi * t / 2.2)
    angles = {}
    for side, delay in (("left", 0.0), ("right", 0.06)):
        late = forward - 0.6 * delay * np.sin(np.pi * forward)
        angles[f"{side}_shoulder.abduction"] = np.radians(7.0 + 83.0 * up)
        angles[f"{side}_shoulder.elevation"] = np.radians(-3.0 + 7.0 * forward)
        angles[f"{side}_shoulder.twist"] = np.radians(4.0 * sway * up)
        angles[f"{side}_elbow.extension"] = np.radians(12.0 - 6.0 * up + 94.0 * late)
    lean = rigid.so3_exp(np.radians([1.2 * sway, -5.0 * forward + 1.5 * up, 3.5 * np.sin(2 * np.pi * t / 1.7)]))
    dip = 0.007 + 0.005 * up + 0.014 * forward
    trunk = (0.01 - 0.035 * forward, 0.008 * sway, standing_height(model) - dip)
    return Posture(trunk, lean, stance(model), angles)


def walk_in_place(model: BodyModel, t: float) -> Posture:
    """Walk on the spot: knees lifted in turn, bent arms swinging against them."""
    phase = 2 * np.pi * t / 1.3
    start = ramp(t, 0.0, 0.5)
    swing = start * np.sin(phase)
    feet = {}
    for side, (x, y, z) in stance(model).items():
        lift = start * max(0.0, swing if side == "left" else -swing) ** 1.5
        feet[side] = (x + 0.04 * lift, y, z + 0.11 * model.height_m * lift)
    angles = {}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        angles[f"{side}_shoulder.abduction"] = np.radians(10.0 + 4.0 * start)
        angles[f"{side}_shoulder.elevation"] = np.radians(5.0 * start + 34.0 * sign * swing)
        angles[f"{side}_shoulder.twist"] = np.radians(10.0 * start)
        angles[f"{side}_elbow.extension"] = np.radians(14.0 + start * (38.0 + 24.0 * sign * np.sin(phase)))
    lean = rigid.so3_exp(np.radians([1.5 * swing, 3.0 * start, 6.0 * swing]))
    bob = 0.014 * start * np.cos(2 * phase)
    # The weight shifts over the standing foot, away from the lifted one.
    trunk = (0.0, -0.028 * swing, standing_height(model) - 0.022 + bob)
    return Posture(trunk, lean, feet, angles)


def _face_to_face(partners: tuple[Partner, Partner]) -> tuple[Role, ...]:
    man, woman = partners
    return Role("man", MAN_M, man.act, MAN, BLACK_AND_WHITE), Role("woman", WOMAN_M, woman.act, WOMAN, RED)


def _couple(apart_m: float, seed: int) -> tuple[Role, ...]:
    return _face_to_face(couple(apart_m, seed))


def _crowd(n: int, seed: int) -> tuple[Role, ...]:
    """Place people at the corners of a triangle or a square, `CROWD_APART_M` apart and facing its middle."""
    radius = CROWD_APART_M / (2 * np.sin(np.pi / n))
    looks = ((1.82, MAN, BLACK_AND_WHITE), (1.64, WOMAN, RED), (1.74, MAN, Outfit()), (1.70, WOMAN, GREEN))
    roles = []
    for i, (height_m, build, outfit) in enumerate(looks[:n]):
        angle = 2 * np.pi * i / n
        home = (radius * np.cos(angle), radius * np.sin(angle), angle + np.pi)
        roles.append(Role(f"person{i + 1}", height_m, mingling(n * seed + i, home).act, build, outfit))
    return tuple(roles)


MakeRoles = Callable[[int], tuple[Role, ...]]

MAN_M, WOMAN_M = 1.80, 1.66
CROWD_APART_M = 1.0

SCENES: Mapping[str, MakeRoles] = MappingProxyType(
    {
        "elbow_rotation": lambda seed: (Role("person", 1.78, elbow_rotation),),
        "walk_in_place": lambda seed: (Role("person", 1.78, walk_in_place),),
        "exercise": lambda seed: (Role("person", 1.78, exercise(seed).act),),
        "dance": lambda seed: (Role("person", 1.78, dance(seed).act),),
        "reach_and_cross": lambda seed: (Role("person", 1.78, reach_and_cross(seed).act),),
        "leaving": lambda seed: (Role("person", 1.78, leaving(seed).act),),
        "tango": lambda seed: _face_to_face(tango(MAN_M, WOMAN_M)),
        **{f"couple_{name}": partial(_couple, m) for name, m in COUPLE_APART_M.items()},
        "crowd_of_three": partial(_crowd, 3),
        "crowd_of_four": partial(_crowd, 4),
    }
)
"""Makes the roles of each scene for a seed; the first two and the tango are the same for every seed."""


def cast_of(scene: str, seed: int = 0, person: str = "") -> tuple[Role, ...]:
    """Return the roles of a scene.

    Args:
        scene: one of `SCENES`.
        seed: of its motion.
        person: one of `population.POPULATION`, who plays a scene of one person; the usual adult if empty.

    Raises:
        TrackerError: there is no such scene or person, or the scene has several people.
    """
    if scene not in SCENES:
        raise TrackerError(f"expected one of the scenes {', '.join(SCENES)}, found '{scene}'")
    roles = SCENES[scene](seed)
    if not person:
        return roles
    if len(roles) > 1:
        raise TrackerError(f"expected a scene of one person for '{person}', found '{scene}' with {len(roles)}")
    return (replace(roles[0], **individual(person)._asdict()),)
