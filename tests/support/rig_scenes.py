"""People before a rig of cameras of which some are off, as a diagnosis sees them."""

from dataclasses import replace

import numpy as np
from staging import cameras_around, own_evidence, posed, shaken

from tracker.body.model import PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.calibration.check.judged_frames import JudgedFrame
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.formats.model_toml import load_model
from tracker.geometry.camera_correction import N_CORRECTIONS, corrected, later_s

CAMERAS = cameras_around(4)
NAMES = [c.name for c in CAMERAS]
FPS = 30.0


def person_of(model, seed=3, share=0.5):
    """A person whose lengths and girths differ from a model's as people differ."""
    parameters = SizeParameters(model)
    sizes = share * np.random.default_rng(seed).normal(size=len(parameters.names)) * parameters.sigmas
    sizes[parameters.of_kinds("taper", "exponent", "joint", "side")] = 0.0
    return parameters.body(sizes)


def viewed(off, frames=range(6), model=None, person=None, cameras=CAMERAS):
    """Frames that cameras show which are off, with poses as a tracker would leave them.

    Args:
        off: by index of a camera, how it really stands, as a correction of its calibration, (N_CORRECTIONS,).
        frames: seeds of the poses.
        model: body of the tracker.
        person: body of the person; by default the same.
        cameras: the calibration.
    """
    model = model or load_model("gavrila22", 1.7)
    person, random = person or model, np.random.default_rng(0)
    out = []
    for k in frames:
        pose, velocity = posed(person, k), random.normal(scale=1.0, size=model.n_dofs)
        views = []
        for i, camera in enumerate(cameras):
            correction = off.get(i, np.zeros(N_CORRECTIONS))
            then = person.clip(person.retract(pose, later_s(correction, k / FPS) * velocity))
            (view,) = own_evidence([PosedBody(person, then)], [corrected(camera, correction)])
            views.append(replace(view, camera=camera))
        start = shaken(model, pose, random, 0.02, 0.01)
        out.append(
            JudgedFrame(
                k,
                tuple(views),
                (PosedBody(model, start),),
                (PosePath.steady(velocity, FPS),),
                k / FPS,
                (0.0,) * len(cameras),
            )
        )
    return out


def turned(pitch_deg=0.0, yaw_deg=0.0, roll_deg=0.0):
    """The correction of a turned camera."""
    out = np.zeros(N_CORRECTIONS)
    out[:3] = np.radians([pitch_deg, yaw_deg, roll_deg])
    return out


def nothing_seen(view):
    """A view without its points, which then does not count."""
    return replace(view, points_px=view.points_px[:0], silhouette=None)
