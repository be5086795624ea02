"""A real frame, read once: frame 25 of the bundled sample, with the body fitted to its true joints."""

from pathlib import Path
from typing import NamedTuple

import pytest

from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.session.session import load_session

SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "elbow_rotation"


class RealFrame(NamedTuple):
    model: BodyModel
    values: Array
    """Pose fitted to the true joints, (n_values,); its bones are not the true ones."""
    views: tuple[ViewEvidence, ...]


@pytest.fixture(scope="session")
def sample_folder():
    return SAMPLE


@pytest.fixture(scope="session")
def real_frame(sample_folder):
    session = load_session(sample_folder)
    with open_observer(session.cameras) as observer:
        views = observer.evidence(25)
    joints = read_joints(sample_folder / "truth.trc", session.fps)
    model = session.people[0].model
    return RealFrame(model, fit_to_points(model, dict(zip(joints.names, joints.points[25], strict=True))).pose, views)
