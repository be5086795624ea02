"""Small corrections of a camera: its rotation, the place of its centre, its focal length, and its clock.

    R' = exp([w]x) R,   C' = C + R^T t,   f' = e^s f,   and the picture of time T shows time T + d + r T.

R maps the world to the camera, C is its centre in the world, f its focal lengths. `KINDS` names w, t, s, d, r.
"""

from types import MappingProxyType

import numpy as np

from tracker.geometry.arrays import Array
from tracker.geometry.camera_derivatives import consecutive, moved_camera, n_camera_parameters
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp, so3_log

KINDS = MappingProxyType(consecutive(rotation=3, position=3, focal=1, time=1, drift=1))
"""Columns of a correction, (9,): w in rad and t in metres, both along the axes of the camera, s, d in seconds, and r in
seconds per second."""
ROTATION, POSITION, FOCAL, TIME = KINDS["rotation"], KINDS["position"], KINDS["focal"].start, KINDS["time"].start
DRIFT, N_CORRECTIONS = KINDS["drift"].start, KINDS["drift"].stop


def corrected(camera: Camera, correction: Array) -> Camera:
    """Return a camera with a correction, (N_CORRECTIONS,), except that of its clock."""
    if not correction[:TIME].any():
        return camera
    step = np.zeros(n_camera_parameters(camera))
    step[:TIME] = correction[:TIME]  # The columns of a whole camera begin with these.
    return moved_camera(camera, step)


def later_s(correction: Array, time_s: float) -> float:
    """Return by how much later a correction, (N_CORRECTIONS,), says that the picture of a time was taken, seconds."""
    return float(correction[TIME] + correction[DRIFT] * time_s)


def with_step(correction: Array, step: Array) -> Array:
    """Return a correction, (N_CORRECTIONS,), after a further small step, (N_CORRECTIONS,)."""
    out = correction + step
    if not step[ROTATION].any():
        return out
    out[ROTATION] = so3_log(so3_exp(step[ROTATION]) @ so3_exp(correction[ROTATION]))
    return out


def in_units(correction: Array) -> dict[str, list[float] | float]:
    """Return a correction, or its standard deviations, (N_CORRECTIONS,), in the units of people: degrees, mm, percent,
    ms, and ms per second; in the order of `KINDS`."""
    return {
        "rotation_deg": np.degrees(correction[ROTATION]).tolist(),
        "position_mm": (1000 * correction[POSITION]).tolist(),
        "focal_percent": float(100 * np.expm1(correction[FOCAL])),
        "time_ms": float(1000 * correction[TIME]),
        "drift_ms_per_s": float(1000 * correction[DRIFT]),
    }
