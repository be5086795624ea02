"""The flesh of a simulated person: rounded lobes around an anatomical skeleton, blended into one surface.

The lobes are independent of the primitives that are fitted: muscles, hands, feet, nose and hair are separate lobes.
"""

from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.simulate.people.skeleton import Factors

Point = tuple[float, float, float]

FEET = ("left_foot", "right_foot")
MAX_ANKLE_BEND_RAD = np.radians(40.0)
ANKLE_HEIGHT = 0.039
"""Height of the ankle joints over the sole, fraction of body height."""


class Lobe(NamedTuple):
    """A round cone (the hull of two balls), squashed across."""

    bone: str
    """Name of the part, or of one of `FEET`, in whose frame the lobe lies."""
    start: Point
    """Centre of one ball, fraction of body height."""
    end: Point
    """Centre of the other ball, fraction of body height."""
    radii: tuple[float, float]
    """Radii of the balls, fraction of body height."""
    squash: Factors = (1.0, 1.0, 1.0)
    """Scale of the lobe along the bone's x, y, z about the bone's origin."""


def bone_names(model: BodyModel) -> tuple[str, ...]:
    """Return the names of the bones that carry flesh: the model's parts, then the feet (no joints in the model)."""
    return tuple(p.name for p in model.parts) + FEET


def bone_poses(model: BodyModel, values: Array) -> Array:
    """Place the bones in a pose.

    A foot sits at the ankle and stays flat on the floor, with the heading of its calf, as far as an ankle bends.

    Returns:
        `Ts_world_bone`, (n_bones, 4, 4), metres, in the order of `bone_names`.
    """
    Ts = model.kinematics(values).Ts_world_part
    points = model.named_points_world(values)
    feet = []
    for side in ("left", "right"):
        R_calf = Ts[model.part_index[f"{side}_calf"], :3, :3]
        heading = np.arctan2(R_calf[1, 0], R_calf[0, 0])
        bend = rigid.so3_log(R_calf.T @ rigid.so3_exp(np.array([0.0, 0.0, heading])))
        bend *= min(1.0, MAX_ANKLE_BEND_RAD / max(float(np.linalg.norm(bend)), 1e-9))
        feet.append(rigid.transform(R_calf @ rigid.so3_exp(bend), points[f"{side}_ankle"]))
    return np.concatenate([Ts, feet])


def lobes(model: BodyModel) -> list[Lobe]:
    """List the lobes of a body whose limbs have the model's lengths."""
    lengths = {name: float(-z) for name, z in _limb_ends(model)}
    left = _arm(lengths["elbow"], lengths["wrist"]) + _leg(lengths["knee"], lengths["ankle"]) + _half_trunk(model)
    return _middle() + left + [_mirrored(lobe) for lobe in left]


def _limb_ends(model: BodyModel) -> list[tuple[str, float]]:
    ends = [(j.name, j.position[2]) for j in model.joints] + [(m.name, m.position[2]) for m in model.landmarks]
    return [(name.removeprefix("left_"), z) for name, z in ends if name.startswith("left_")]


def _mirrored(lobe: Lobe) -> Lobe:
    (x0, y0, z0), (x1, y1, z1) = lobe.start, lobe.end
    return lobe._replace(bone=lobe.bone.replace("left_", "right_"), start=(x0, -y0, z0), end=(x1, -y1, z1))


def _middle() -> list[Lobe]:
    """Return head, neck and belly."""
    return [
        Lobe("torso", (-0.010, 0, 0.150), (-0.004, 0, 0.200), (0.036, 0.030)),  # neck
        Lobe("torso", (0.010, 0, 0.055), (0.016, 0, -0.085), (0.045, 0.042)),  # breastbone to belly
        Lobe("head", (-0.006, 0, 0.00), (0.000, 0, 0.055), (0.030, 0.030)),
        Lobe("head", (0.004, 0, 0.100), (-0.010, 0, 0.100), (0.049, 0.049), (1.0, 0.90, 1.0)),  # cranium
        Lobe("head", (0.022, 0, 0.085), (0.030, 0, 0.042), (0.034, 0.020), (1.0, 0.95, 1.0)),  # face and jaw
        Lobe("head", (0.056, 0, 0.082), (0.063, 0, 0.070), (0.0045, 0.0075)),  # nose
        Lobe("head", (-0.020, 0, 0.115), (0.016, 0, 0.124), (0.042, 0.034), (1.0, 0.95, 1.0)),  # hair
        Lobe("head", (-0.030, 0, 0.090), (-0.030, 0, 0.055), (0.034, 0.022)),  # hair at the nape
    ]


def _half_trunk(model: BodyModel) -> list[Lobe]:
    """Return the left half of the trunk, whose corners are the model's shoulder and hip."""
    joints = {j.name: j.position for j in model.joints}
    _, shoulder_y, shoulder_z = joints["left_shoulder"]
    _, hip_y, hip_z = joints["left_hip"]
    return [
        Lobe("torso", (-0.004, 0.036, 0.110), (-0.002, 0.031, 0.025), (0.056, 0.054)),  # rib cage
        Lobe("torso", (0.026, 0.036, 0.105), (0.026, 0.044, 0.100), (0.030, 0.032)),  # breast
        Lobe("torso", (-0.030, 0.040, 0.115), (-0.024, 0.046, 0.065), (0.034, 0.030)),  # shoulder blade
        Lobe("torso", (-0.010, 0.010, shoulder_z + 0.026), (-0.003, shoulder_y, shoulder_z - 0.008), (0.029, 0.028)),
        Lobe("torso", (0.0, 0.030, -0.005), (0.0, 0.030, -0.070), (0.048, 0.047)),  # waist
        Lobe("torso", (-0.002, hip_y - 0.009, -0.100), (-0.002, hip_y - 0.003, hip_z), (0.051, 0.050)),  # pelvis
        Lobe("torso", (-0.026, 0.032, hip_z + 0.012), (-0.022, 0.040, hip_z - 0.010), (0.042, 0.040)),  # buttock
    ]


def _arm(upper: float, fore: float) -> list[Lobe]:
    """Return the left arm; the back of the hand faces out (y), the thumb forward (x)."""
    out = [
        Lobe("left_upper_arm", (0, 0.000, -0.004), (0, 0.004, -0.36 * upper), (0.032, 0.028)),  # deltoid
        Lobe("left_upper_arm", (0, 0, -0.1 * upper), (0, 0, -upper), (0.027, 0.0215)),
        Lobe("left_upper_arm", (0.007, 0, -0.42 * upper), (0.006, 0, -0.72 * upper), (0.0225, 0.0210)),  # biceps
        Lobe("left_upper_arm", (-0.008, 0, -0.35 * upper), (-0.006, 0, -0.65 * upper), (0.0215, 0.0200)),
        Lobe("left_forearm", (0, 0, 0), (0, 0, -fore), (0.0215, 0.0150)),
        Lobe("left_forearm", (0.003, 0.004, -0.16 * fore), (0.002, 0.002, -0.45 * fore), (0.0225, 0.0195)),
        Lobe("left_forearm", (-0.002, -0.003, -0.12 * fore), (0, 0, -0.40 * fore), (0.0200, 0.0180)),
    ]
    wrist = -fore
    for x in (-0.0105, 0.0, 0.0105):  # palm
        start, end = (0.8 * x, 0.0, wrist - 0.010), (1.25 * x, -0.002, wrist - 0.046)
        out.append(Lobe("left_forearm", start, end, (0.0125, 0.0115), (1.0, 0.8, 1.0)))
    for x, reach in ((-0.0175, 0.084), (-0.006, 0.094), (0.006, 0.098), (0.0175, 0.090)):  # fingers, a little curled
        middle = (1.05 * x, -0.006, wrist - 0.5 * (0.05 + reach))
        out.append(Lobe("left_forearm", (x, -0.002, wrist - 0.05), middle, (0.0075, 0.0066)))
        out.append(Lobe("left_forearm", middle, (x, -0.015, wrist - reach), (0.0066, 0.0058)))
    out.append(Lobe("left_forearm", (0.012, -0.003, wrist - 0.018), (0.031, -0.011, wrist - 0.052), (0.010, 0.0068)))
    return out


def _leg(thigh: float, calf: float) -> list[Lobe]:
    """Return the left leg and foot, in trousers and shoes."""
    return [
        Lobe("left_thigh", (0, 0.001, -0.03), (0, 0, -thigh), (0.0475, 0.0325)),
        Lobe("left_thigh", (0.009, 0.004, -0.25 * thigh), (0.007, 0.003, -0.78 * thigh), (0.040, 0.029)),
        Lobe("left_thigh", (-0.010, 0.0, -0.25 * thigh), (-0.007, 0.0, -0.75 * thigh), (0.038, 0.028)),
        Lobe("left_calf", (0.003, 0, 0), (0.001, 0, -0.20 * calf), (0.0325, 0.0290)),
        Lobe("left_calf", (0, 0, -0.1 * calf), (0, 0, -0.90 * calf), (0.0290, 0.0245)),
        Lobe("left_calf", (-0.010, 0.002, -0.20 * calf), (-0.007, 0.001, -0.48 * calf), (0.0285, 0.0255)),
        Lobe("left_calf", (-0.002, 0, -0.80 * calf), (-0.002, 0, -0.93 * calf), (0.0265, 0.0275)),  # hem
        Lobe("left_foot", (0, 0, 0.012), (0.002, 0, -0.008), (0.0195, 0.0220)),
        Lobe("left_foot", (-0.024, 0, -0.013), (0.030, 0.002, -0.014), (0.0195, 0.0205)),
        Lobe("left_foot", (0.020, 0, -0.006), (0.066, 0.004, -0.018), (0.0200, 0.0165)),
        Lobe("left_foot", (0.066, 0.011, -0.0205), (0.092, 0.008, -0.0215), (0.0150, 0.0130)),
        Lobe("left_foot", (0.066, -0.008, -0.0205), (0.098, -0.005, -0.0215), (0.0150, 0.0130)),
    ]
