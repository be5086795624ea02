"""The evidence of all frames of a run, for the solve of its path."""

import numpy as np
import pytest
from region_scenes import N_FRAMES, Filmed, Walk
from staging import SUIT

from tracker.body.model import PosedBody
from tracker.fitting.gauss_newton import GaussianPrior, solve
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimation import path_evidence
from tracker.tracking.estimation.path_evidence import evidence_of_frames


@pytest.fixture(scope="module")
def walk(gavrila):
    return Walk(gavrila, SUIT)


class Counted(Filmed):
    """Counts how often each frame is read."""

    def __init__(self, walk):
        super().__init__(walk)
        self.read = []

    def evidence(self, frame, regions, *args, **kwargs):
        self.read.append(frame)
        return super().evidence(frame, regions)


@pytest.mark.slow  # compiles kernels
def test_frames_are_read_once_and_colors_count(walk):
    model, observer, rng = walk.model, Counted(walk), np.random.default_rng(1)
    sigma = np.where(model.dof_is_length, 0.01, 0.03)
    start = [model.clip(model.retract(true.values, rng.normal(0, sigma))) for (true,) in walk.true]
    evidence = evidence_of_frames(
        observer, lambda: {k: (PosedBody(model, pose),) for k, pose in enumerate(start)}, TrackSettings()
    )
    assert observer.read == []
    blocks = [evidence(k, 0) for k in range(N_FRAMES)]
    assert sorted(observer.read) == list(range(N_FRAMES))  # the colors are learned from all

    def off_m(chosen):
        found = []
        for pose, own, (true,) in zip(start, blocks, walk.true, strict=True):
            fit = solve(model, pose, [GaussianPrior(pose, np.diag(1 / sigma**2)), *own[chosen]])
            found.append(np.abs(model.points_world(fit.pose) - true.points_world).mean())
        return np.mean(found)

    assert off_m(slice(None)) < 0.9 * off_m(slice(-1)) < 0.9 * off_m(slice(0))


@pytest.mark.slow  # compiles kernels
def test_few_frames_are_held_at_once(walk, monkeypatch):
    monkeypatch.setattr(path_evidence, "FRAMES_AT_ONCE", 3)
    observer = Counted(walk)
    evidence = evidence_of_frames(observer, lambda: dict(enumerate(map(tuple, walk.true))), TrackSettings())
    for k in (0, 1, 2, 1, 2):
        evidence(k, 0)
    assert observer.read == [*range(N_FRAMES), 1, 2]


def test_frames_of_which_nobody_knows_a_pose_have_no_evidence():
    evidence = evidence_of_frames(None, lambda: {}, TrackSettings())
    assert evidence(3, 0) == ()
