"""Fit and check the weights and thresholds of `tracker/tracking/confidence.py`.

`python tests/benchmarks/calibrate_status.py` makes simulated scenes (people whose shape is not the model's, clutter,
noise), tracks them with and without the search for lost limbs, fits the logistic function of the evidence to the
scenes of `FIT`, and prints its weights. It then prints, for thresholds of doubt, how many of the lost frames are
flagged and how many of the frames called good are lost: on each scene of `FIT` by weights fitted to the other scenes,
and on the scenes of `CHECK`, which nothing was set by, as the tracker calls them now. A limb is lost when one of its
joints is off by more than 150 mm. With `--scenes DIR` scenes are kept there and taken up again;
`--check` leaves the fit out.
"""

import argparse
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from true_starts import read_simulated

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import Array
from tracker.simulate import Simulation, simulate
from tracker.simulate.motion.scenes import cast_of
from tracker.tracking import confidence
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

VGA, SMALL = (640, 480), (320, 240)


class Scene(NamedTuple):
    """A simulated scene."""

    name: str
    seed: int
    cameras: int = 4
    size: tuple[int, int] = VGA

    @property
    def of_several(self) -> bool:
        """Whether it shows more than one person."""
        return len(cast_of(self.name, self.seed)) > 1


FIT = (
    *(Scene(n, s) for n, s in (("exercise", 1), ("exercise", 2), ("dance", 1), ("dance", 2), ("dance", 3))),
    *(Scene(n, s) for n, s in (("leaving", 1), ("leaving", 2), ("reach_and_cross", 1), ("reach_and_cross", 3))),
    Scene("couple_near", 1), Scene("couple_touching", 2), Scene("couple_overlapping", 3), Scene("tango", 4),
)  # fmt: skip
CHECK = (
    *(Scene(n, s) for n in ("exercise", "dance", "leaving", "reach_and_cross") for s in (11, 12, 31)),
    Scene("dance", 13, 3, SMALL), Scene("exercise", 13, 6, SMALL),
    Scene("couple_overlapping", 41), Scene("couple_touching", 42), Scene("tango", 44),
)  # fmt: skip
LOST_M = 0.15
UNSEARCHED_WEIGHT = 0.3
"""What a frame counts that was tracked without search: more is lost there, but not as it is lost with search."""
RIDGE = 3e-3
THRESHOLDS = (-4.0, -3.5, -3.0, -2.5, -2.0, -1.0, 0.0)


class Limbs:
    """What is known of the limbs of all frames of a scene, one row each."""

    def __init__(self) -> None:
        self.evidence: list[Array] = []
        self.lost: list[bool] = []
        self.searched: list[bool] = []
        self.frames: list[tuple[int, int]] = []  # person and frame
        self.statuses: list[Status] = []

    def add(self, scene: Path, settings: TrackSettings) -> None:
        """Track a scene and note what there is to know of each limb."""
        session, models, truths, starts = read_simulated(scene)
        limb_joints = [t.points[:, [t.names.index(n) for n in LIMB_JOINTS]] for t in truths]
        with Recording(session.cameras) as recording:
            observer, frames = Observer(session.cameras, recording), range(session.n_frames)
            subjects = Subjects.of(models, keyframes={0: dict(enumerate(starts))})
            for found in ChamferTracker(settings).estimates(TrackingRun(observer, subjects, starts, frames)):
                for person, (model, joints) in enumerate(zip(models, limb_joints, strict=True)):
                    self._add_person(person, model, joints[found.frame], found, settings.recover is not None)

    def _add_person(self, person: int, model: BodyModel, truth: Array, found: PoseEstimate, searched: bool) -> None:
        """Note what there is to know of the limbs of a person, whose true limb joints are (12, 3), on a frame."""
        quality = found.qualities[person]
        if quality is None:
            return
        joints = model.points_world(found.poses[person])[[model.point_names.index(n) for n in LIMB_JOINTS]]
        off = np.linalg.norm(joints - truth, axis=-1) > LOST_M
        for limb in quality.limbs:
            of_limb = _joints(model, limb.name)
            if of_limb.any():
                self.evidence.append(confidence.features(quality, limb))
                self.lost.append(bool(off[of_limb].any()))
                self.searched.append(searched)
                self.frames.append((person, found.frame))
                self.statuses.append(found.statuses[person])


def _joints(model: BodyModel, limb: str) -> NDArray[np.bool_]:
    """Which of the limb joints belong to a limb."""
    parts = next(x.parts for x in limbs(model) if x.name == limb)
    return np.isin([model.point_parts[model.point_names.index(n)] for n in LIMB_JOINTS], parts)


def fitted(scenes: Sequence[Limbs]) -> Array:
    """Weights of the evidence and, last, the constant, by ridge regression on standardized evidence."""
    X = np.concatenate([np.array(s.evidence) for s in scenes])
    y = np.concatenate([np.array(s.lost, dtype=float) for s in scenes])
    w = np.concatenate([np.where(s.searched, 1.0, UNSEARCHED_WEIGHT) for s in scenes])
    middle, spread = X.mean(axis=0), X.std(axis=0) + 1e-9
    Z = np.column_stack([(X - middle) / spread, np.ones(len(X))])

    def loss(b: Array) -> tuple[float, Array]:
        odds = Z @ b
        ridge = np.append(b[:-1], 0.0)
        value = np.average(np.logaddexp(0, odds) - y * odds, weights=w) + RIDGE * ridge @ ridge
        return float(value), Z.T @ (w * (1 / (1 + np.exp(-odds)) - y)) / w.sum() + 2 * RIDGE * ridge

    b = minimize(loss, np.zeros(Z.shape[1]), jac=True).x
    return np.append(b[:-1] / spread, b[-1] - np.sum(b[:-1] * middle / spread))


def by_frame(scene: Limbs, values: NDArray[Any], merge: Callable[[NDArray[Any]], Any]) -> NDArray[Any]:
    """One figure for each person and frame that was tracked as the tracker does, from one for each of their limbs."""
    frames, searched = np.array(scene.frames), np.array(scene.searched)
    each = np.unique(frames[searched], axis=0)
    return np.array([merge(values[(frames == k).all(axis=1) & searched]) for k in each])


def share(of: NDArray[np.bool_]) -> float:
    """Share of what holds; 0 of nothing."""
    return float(of.mean()) if len(of) else 0.0


def report(flags: NDArray[np.bool_], lost: NDArray[np.bool_]) -> str:
    """What flags are worth."""
    return (
        f"{share(flags[lost]):.0%} of {lost.sum()} lost frames flagged, {share(lost[~flags]):.1%} of the others lost, "
        f"{share(~flags[~lost]):.0%} of the found frames called good"
    )


def main() -> None:
    """Fit, check and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=Path, help="folder where simulated scenes are kept")
    parser.add_argument("--frames", type=int, default=90, help="frames of a scene that is made")
    parser.add_argument("--check", action="store_true", help="fit nothing: only check, in a third of the time")
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = words.scenes or Path(name)
        tracked = {}
        for spec in CHECK if words.check else FIT + CHECK:
            path = folder / f"{spec.name}_{spec.seed}"
            if not path.exists():
                # Two people are two persons' frames, and take longer.
                n_frames = words.frames // 2 if spec.of_several else words.frames
                simulate(path, Simulation(spec.name, spec.cameras, n_frames, spec.seed, spec.size))
            tracked[spec] = limbs = Limbs()
            limbs.add(path, TrackSettings())
            if spec in FIT:
                limbs.add(path, replace(TrackSettings(), recover=None))
            print(f"{spec.name} {spec.seed}: {sum(limbs.lost)} limbs of {len(limbs.lost)} lost", flush=True)
    if not words.check:
        _tell_fit([tracked[s] for s in FIT])
    _tell_check(tracked)


def _tell_fit(fit: Sequence[Limbs]) -> None:
    """Print the weights fitted to scenes, and what they are worth on each by those of the others."""
    print("weights:", np.round(fitted(fit), 3).tolist())
    weights = [fitted(fit[:i] + fit[i + 1 :]) for i in range(len(fit))]
    odds = [by_frame(x, np.array(x.evidence) @ w[:-1] + w[-1], np.max) for x, w in zip(fit, weights, strict=True)]
    lost = np.concatenate([by_frame(x, np.array(x.lost), np.any) for x in fit])
    for threshold in THRESHOLDS:
        print(f"left out one by one, doubt from {threshold}:", report(np.concatenate(odds) > threshold, lost))


def _tell_check(tracked: Mapping[Scene, Limbs]) -> None:
    """Print how the tracker calls frames of scenes that nothing was set by."""
    for size, of_several in ((VGA, False), (SMALL, False), (VGA, True)):
        check = [tracked[s] for s in CHECK if s.size == size and s.of_several == of_several]
        flags = np.concatenate([by_frame(x, np.array([s != "good" for s in x.statuses]), np.any) for x in check])
        lost = np.concatenate([by_frame(x, np.array(x.lost), np.any) for x in check])
        whose = "two people" if of_several else "one person"
        print(f"as called, on other scenes, {whose}, {size[0]}x{size[1]}:", report(flags, lost))


if __name__ == "__main__":
    main()
