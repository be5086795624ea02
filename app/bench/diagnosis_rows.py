"""Rows of `quadrille bench` on the diagnosis of cameras."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from app.bench.rows import Row, Yardstick, in_yardsticks
from app.bench.sample_frames import BenchFrame, pose_at
from tracker.body.model import PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.calibration.check.diagnosis import Diagnosis, diagnose
from tracker.calibration.check.judged_frames import JudgedFrame
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.tracking.view_regions import regions
from tracker.evidence.observer import open_observer
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION, corrected

_N_FRAMES, _TURN_DEG = 20, 0.7
_MUST_MS = 3000
"""Largest allowed processor time of a diagnosis."""


def diagnoses(frame: BenchFrame, yardstick: Yardstick) -> list[Row]:
    """Diagnose the cameras of 20 frames from their footage on, as they are, and with one that was turned."""
    turned = np.zeros(N_CORRECTIONS)
    turned[ROTATION] = 0.0, np.radians(_TURN_DEG), 0.0
    return [
        _diagnosis("diagnosis", "cameras diagnosed", frame, np.zeros(N_CORRECTIONS), yardstick),
        _diagnosis("diagnosis_turned", f"one of them turned by {_TURN_DEG} degrees", frame, turned, yardstick),
    ]


def _diagnosis(name: str, what: str, frame: BenchFrame, correction: Array, yardstick: Yardstick) -> Row:
    cameras, poses = frame.session.cameras, _true_poses(frame)

    def work() -> Diagnosis:
        return diagnose(_seen(frame, poses, correction), [SizeParameters(frame.model)], frame.session.fps)

    named = sorted({cameras[k.fault.camera].camera.name for k in work().kept})
    return Row(
        name,
        f"{what}, {_N_FRAMES} frames, {len(cameras)} views",
        *yardstick.beside(work, 3),
        in_yardsticks(_MUST_MS),
        note=f"names {', '.join(named) or 'no camera'}",
    )


def _true_poses(frame: BenchFrame) -> dict[int, Array]:
    poses = dict[int, Array]()
    for k in range(frame.session.n_frames):
        poses[k] = pose_at(frame.joints, frame.model, k, poses.get(k - 1))
    return poses


def _seen(frame: BenchFrame, poses: Mapping[int, Array], correction: Array) -> list[JudgedFrame]:
    """Read frames on which people have their true poses, with a correction of the first camera."""
    session, out = frame.session, list[JudgedFrame]()
    with open_observer(session.cameras) as observer:
        for k in np.linspace(2, session.n_frames - 3, _N_FRAMES).round().astype(int).tolist():
            body = PosedBody(frame.model, poses[k])
            first, *others = observer.evidence(k, regions(observer.working_cameras, [body]))
            views = (replace(first, camera=corrected(first.camera, correction)), *others)
            path = PosePath.around(frame.model, poses, k, session.fps)
            time_s = (k - session.n_frames / 2) / session.fps
            out.append(JudgedFrame(k, views, (body,), (path,), time_s, (0.0,) * len(views)))
    return out
