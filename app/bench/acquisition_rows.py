"""The rows of `quadrille bench` about acquisition: a body from five frames in four views, and scipy on one frame."""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares

from app.bench.rows import CORES, Row, Yardstick, edge_distances, in_yardsticks
from app.bench.sample_frames import FRAME, BenchFrame, pose_at
from tracker.body.model import PosedBody
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings, acquire_from_contours
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import Array

N_FRAMES = 5
_EVERY = 5
"""Distance of the frames to choose from."""
_MUST_MS, _AIM_MS = 20e3, 10e3
"""Largest allowed and desired time by the clock, ms; see `rows.in_yardsticks`."""
_TALLER = 1.03
"""Height of the body to begin with, in true heights."""


def acquisitions(frame: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """A body from the footage: frames chosen, contours read, sizes and poses fitted; and one step of it by scipy."""
    settings, body = AcquisitionSettings(n_frames=N_FRAMES), frame.model.with_height(_TALLER * frame.model.height_m)
    numbers = range(0, frame.session.n_frames, _EVERY)
    poses = {k: _off(frame, pose_at(frame.joints, body, k, frame.values)) for k in numbers}
    found = list[Acquisition]()
    with open_observer(frame.session.cameras) as observer:

        def run() -> None:
            bodies = {k: (PosedBody(body, pose),) for k, pose in poses.items()}
            found.append(acquire_from_contours(observer, bodies, 0, {}, settings))

        timed = yardstick.beside(run, 3)
    last = found[-1]
    before = [PosedBody(body, poses[k]) for k in last.frames]
    after = [PosedBody(last.body, pose) for pose in last.poses]
    off_mm = [
        1000 * np.mean([_off_m(frame, b, k) for b, k in zip(bodies, last.frames, strict=True)])
        for bodies in (before, after)
    ]
    note = f"{off_mm[0]:.0f} mm off, then {off_mm[1]:.0f}"
    must, aim = (in_yardsticks(ms, CORES) for ms in (_MUST_MS, _AIM_MS))
    yield Row("acquisition", f"body from {N_FRAMES} frames, 4 views", *timed, must, aim, note)
    n, pose = last.parameters.base.n_dofs, poses[FRAME - FRAME % _EVERY]
    parameters, edges_px = SizeParameters(body), frame.cost(pose).edge_points_px

    def residuals(unknowns: Array) -> Array:
        model = parameters.body(unknowns[n:])
        own = edge_distances(frame.views, edges_px, PosedBody(model, model.retract(pose, unknowns[:n])))
        return np.concatenate([*own, unknowns[n:] / parameters.sigmas])

    start = np.zeros(n + len(parameters.names))
    timed = yardstick.beside(lambda: least_squares(residuals, start, method="trf", max_nfev=2), 5, 2)
    what = "one of its steps on one frame by scipy's least_squares with numeric Jacobian, edges to contour"
    yield Row("acquisition_step_scipy", what, *timed)


def _off(frame: BenchFrame, pose: Array) -> Array:
    """Return a pose that is off by 1 cm and 3 degrees in every degree of freedom, as a tracked one."""
    model = frame.model
    return np.asarray(model.move(pose, model.difference(frame.near_prediction(), frame.values)))


def _off_m(frame: BenchFrame, body: PosedBody, k: int) -> float:
    """Return the mean distance of a body's limb joints from the true ones on a frame, metres."""
    places = body.named_points_world
    true = dict(zip(frame.joints.names, frame.joints.points[k], strict=True))
    return float(np.mean([np.linalg.norm(places[n] - true[n]) for n in LIMB_JOINTS]))
