"""The inputs of the benchmarks: frames of the bundled sample, and of a simulated scene with six cameras."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.formats.model_toml import load_model
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.session.session import Session, load_session

FRAME = 25
_SEED = 11


@dataclass(frozen=True, eq=False)
class BenchFrame:
    """One frame of a session with its body in the true pose."""

    session: Session
    joints: MarkerTable
    """The true joints of all frames."""
    views: tuple[ViewEvidence, ...]
    """All edges of the frame."""
    model: BodyModel
    values: Array
    """Pose fitted to the true joints, (n_values,)."""

    def with_model(self, name: str) -> "BenchFrame":
        """Return the same frame with another body of the same height."""
        model = load_model(name, self.model.height_m)
        return BenchFrame(self.session, self.joints, self.views, model, pose_at(self.joints, model, FRAME))

    def cost(self, predicted: Array | None = None, threads: int = 2) -> ChamferCost:
        """Return the cost around a prediction, the fitted pose by default."""
        body = PosedBody(self.model, self.values if predicted is None else predicted)
        return ChamferCost(self.views, [body], threads=threads)

    def candidates(self, n: int) -> Array:
        """Spread poses by 10 degrees and 5 cm in every degree of freedom around the fitted one, (n, n_values)."""
        return _spread(self.model, self.values, n)

    def hard_prediction(self) -> Array:
        """Return a prediction off by 10 cm in position and 15 degrees in one angle of the trunk and of each limb."""
        step = np.zeros(self.model.n_dofs)
        off = {"torso.x": 0.08, "torso.y": -0.06, "torso.twist": 15, "left_shoulder.abduction": 15,
               "right_shoulder.elevation": 15, "left_elbow.extension": 15, "left_hip.elevation": 15,
               "right_hip.abduction": 15, "right_knee.extension": 15}  # fmt: skip
        for name, amount in off.items():
            dof = self.model.dof_names.index(name)
            step[dof] = amount if self.model.dof_is_length[dof] else np.radians(amount)
        return self.model.move(self.values, step)

    def near_prediction(self) -> Array:
        """Return a prediction as on a tracked frame: off by 1 cm and 3 degrees in every degree of freedom."""
        off = np.where(self.model.dof_is_length, 0.01, np.radians(3))
        signs = np.random.default_rng(_SEED).choice((-1.0, 1.0), self.model.n_dofs)
        return self.model.move(self.values, off * signs)


@dataclass(frozen=True, eq=False)
class BenchCrowd:
    """One frame of a session of several people with the bodies in their true poses."""

    session: Session
    joints: tuple[MarkerTable, ...]
    """The true joints of all frames, of each person."""
    views: tuple[ViewEvidence, ...]
    """All edges of the frame."""
    models: tuple[BodyModel, ...]
    values: tuple[Array, ...]
    """Poses fitted to the true joints, (n_values,) each."""

    def cost(self, n: int) -> ChamferCost:
        """Return the cost of the first few people around their fitted poses, on one thread."""
        bodies = [PosedBody(m, v) for m, v in zip(self.models[:n], self.values[:n], strict=True)]
        return ChamferCost(self.views, bodies, threads=1)

    def candidates(self, n: int) -> Array:
        """Return poses of the first person, like those of `BenchFrame`, (n, n_values)."""
        return _spread(self.models[0], self.values[0], n)


def _spread(model: BodyModel, values: Array, n: int) -> Array:
    """Return poses spread by 10 degrees and 5 cm in every degree of freedom, (n, n_values)."""
    spread = np.where(model.dof_is_length, 0.05, np.radians(10))
    steps = spread * np.random.default_rng(_SEED).normal(size=(n, model.n_dofs))
    return np.stack([model.move(values, step) for step in steps])


def read_crowd(folder: Path, frame: int) -> BenchCrowd:
    """Read a frame of a simulated session of several people."""
    session = load_session(folder)
    joints = tuple(read_joints(folder / f"truth_{p.name}.trc", session.fps) for p in session.people)
    models = tuple(p.model for p in session.people)
    with open_observer(session.cameras) as observer:
        views = observer.evidence(frame)
    return BenchCrowd(
        session, joints, views, models, tuple(pose_at(j, m, frame) for j, m in zip(joints, models, strict=True))
    )


def read_frame(folder: Path) -> BenchFrame:
    """Read the frame of a simulated session that the benchmarks work on."""
    session = load_session(folder)
    joints = read_joints(folder / "truth.trc", session.fps)
    frame = min(FRAME, session.n_frames - 1)
    with open_observer(session.cameras) as observer:
        views = observer.evidence(frame)
    model = session.people[0].model
    return BenchFrame(session, joints, views, model, pose_at(joints, model, frame))


def pose_at(joints: MarkerTable, model: BodyModel, frame: int, near: Array | None = None) -> Array:
    """Return the pose fitted to the true joints of a frame, (n_values,)."""
    frame = min(frame, len(joints.points) - 1)
    return fit_to_points(model, dict(zip(joints.names, joints.points[frame], strict=True)), near).pose
