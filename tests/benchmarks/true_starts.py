"""Simulated sessions with the poses that benchmarks start from: those fitted to the true joints of frame 0."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import Session, load_session


class Simulated(NamedTuple):
    """A simulated session, and of each person what is fitted, its truth, and where it starts."""

    session: Session
    models: tuple[BodyModel, ...]
    """Generic bodies of the true heights."""
    references: tuple[MarkerTable, ...]
    """True joints."""
    starts: tuple[Array, ...]
    """See `start_of`, (n_values,) each."""


def read_simulated(folder: Path) -> Simulated:
    """Read a session of one or several people that `simulate` made."""
    session = load_session(folder)
    names = ["truth.trc"] if len(session.people) == 1 else [f"truth_{p.name}.trc" for p in session.people]
    models = tuple(load_model(DEFAULT_MODEL, p.model.height_m) for p in session.people)
    references = tuple(read_joints(folder / name, session.fps) for name in names)
    return Simulated(session, models, references, tuple(map(start_of, models, references)))


def start_of(model: BodyModel, reference: MarkerTable) -> Array:
    """The pose fitted to the limb joints of frame 0, (n_values,)."""
    row = reference.points[np.flatnonzero(reference.frames == 0)[0]]
    places = dict(zip(reference.names, row, strict=True))
    return fit_to_points(model, {n: places[n] for n in LIMB_JOINTS}).pose
