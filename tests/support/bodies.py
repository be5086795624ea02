"""Bodies with every kind of joint, for tests that must hold for more than people."""

from dataclasses import replace

import numpy as np

from tracker.body.model import BodyModel
from tracker.formats.model_toml import PRESETS, load_model, parse_model

BALLS = """
version = 1
name = "balls"
height_m = 2.0
joints = [
    { name = "root", child = "trunk", free = true, kind = "ball" },
    { name = "shoulder", parent = "trunk", child = "arm", position = [0, 0.1, 0.2], kind = "ball", cone_deg = 100, twist_deg = 60 },
    { name = "elbow", parent = "arm", child = "forearm", position = [0, 0, -0.2], axes = [
        { name = "bend", axis = [0, -1, 0], limits_deg = [0, 150] },
        { name = "roll", axis = [0, 0, 1], limits_deg = [-90, 90] },
    ] },
    { name = "grip", parent = "forearm", child = "hand", position = [0, 0, -0.15] },
]
parts = [
    { name = "trunk", half_axes = [0.1, 0.1, 0.2] },
    { name = "arm", half_axes = [0.03, 0.03, 0.1] },
    { name = "forearm", half_axes = [0.02, 0.02, 0.08] },
    { name = "hand", half_axes = [0.02, 0.02, 0.02] },
]
landmarks = [{ name = "finger", part = "hand", position = [0.01, 0.02, -0.05] }]
"""  # noqa: E501

MODELS = {name: load_model(name) for name in PRESETS} | {"balls": parse_model(BALLS, "balls")}

ARM = parse_model(
    """
    version = 1
    name = "arm"
    height_m = 1.0
    parts = [{ name = "upper", half_axes = [0.1, 0.1, 0.3] }, { name = "lower", half_axes = [0.1, 0.1, 0.3] }]
    landmarks = [{ name = "hand", part = "lower", position = [0, 0, -0.4] }]
    joints = [
        { name = "shoulder", child = "upper", kind = "ball", free = true, cone_deg = 100, twist_deg = 60 },
        { name = "elbow", parent = "upper", child = "lower", position = [0, 0, -0.3], axes = [
            { name = "bend", axis = [0, -1, 0], limits_deg = [0, 150] },
        ] },
    ]
    """,
    "arm",
)


def set_deg(model, **degrees):
    """The neutral pose but for some angles, degrees; a name has two underscores for its dot."""
    values = model.neutral()
    for name, angle in degrees.items():
        values[model.value_names.index(name.replace("__", "."))] = np.radians(angle)
    return values


def with_center(model: BodyModel, point: str, offset: tuple[float, float, float]) -> BodyModel:
    """Return a model of which the anatomical centre of a joint or landmark is off its pivot, fractions of height."""

    def moved(points):
        return tuple(replace(p, center_offset=offset, center_source="a test") if p.name == point else p for p in points)

    return replace(model, joints=moved(model.joints), landmarks=moved(model.landmarks))
