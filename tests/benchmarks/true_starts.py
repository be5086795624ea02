"""Sessions with the poses that benchmarks start from: those fitted to the true joints of frame 0."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.tracking.tracker import PoseEstimate, Subjects, TrackingRun
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import Session, load_session


class Clip(NamedTuple):
    """The first frames of a session, and of each person what is fitted, its truth, and where it starts."""

    name: str
    session: Session
    models: tuple[BodyModel, ...]
    """Generic bodies of the true heights."""
    references: tuple[MarkerTable, ...]
    """True joints."""
    starts: tuple[Array, ...]
    """See `start_of`, (n_values,) each."""
    frames: range


def read_simulated(folder: Path, n_frames: int) -> Clip:
    """Read the first frames of a session of one or several people that `simulate` made."""
    session = load_session(folder)
    names = ["truth.trc"] if len(session.people) == 1 else [f"truth_{p.name}.trc" for p in session.people]
    models = tuple(load_model(DEFAULT_MODEL, p.model.height_m) for p in session.people)
    references = tuple(read_joints(folder / name, session.fps) for name in names)
    frames = range(min(n_frames, session.n_frames))
    return Clip(folder.name, session, models, references, tuple(map(start_of, models, references)), frames)


def start_of(model: BodyModel, reference: MarkerTable) -> Array:
    """The pose fitted to the limb joints of frame 0, (n_values,)."""
    return fit_to_points(model, limb_joints(reference)[0]).pose


def limb_joints(reference: MarkerTable) -> dict[int, dict[str, Array]]:
    """Return the known limb joints by frame and name, (3,) each, metres."""
    return {
        frame: {n: p for n, p in zip(reference.names, row, strict=True) if n in LIMB_JOINTS and np.all(np.isfinite(p))}
        for frame, row in zip(reference.frames.tolist(), reference.points, strict=True)
    }


def track_from(
    observer: Observer, models: Sequence[BodyModel], starts: Sequence[Array], frames: Sequence[int],
    settings: TrackSettings, fps: float = 30.0,
) -> list[PoseEstimate]:  # fmt: skip
    """Track people by their edges from poses of frame 0, (n_values,) each, which are keyframes."""
    subjects = Subjects.of(models, keyframes={0: dict(enumerate(starts))})
    return list(ChamferTracker(settings).estimates(TrackingRun(observer, subjects, starts, frames, fps)))


def joint_centers(model: BodyModel, pose: Array) -> dict[str, Array]:
    """Return the joint centres of a pose, (n_values,), by name, (3,) each, metres."""
    return dict(zip(model.point_names, model.joint_centers_world(pose), strict=True))
