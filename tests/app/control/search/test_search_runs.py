"""What is kept of a search, however long it is."""

import numpy as np
import pytest

from app.control.search import search_runs
from app.control.search.search_runs import SearchRun, SearchRuns
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchStep
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila22")
START = MODEL.neutral()


def step_of(run, stage, px, best_px, evaluations, done=False, shift_m=0.0):
    pose = START.copy()
    pose[0] += shift_m
    return SearchStep(run.stages[stage], (pose,), px, (pose,), best_px, evaluations, done)


def begun():
    return SearchRun(0, [MODEL], (START,), 9.0, TrackSettings())


def test_long_searches_are_thinned_and_keep_what_matters(monkeypatch):
    monkeypatch.setattr(search_runs, "MAX_STEPS", 100)
    run, best = begun(), 9.0
    for i in range(1000):
        best -= 0.01 if i % 50 == 0 else 0.0
        run.add(step_of(run, 0, best + 1, best, i + 1), 0.1)
    assert len(run.steps) <= 100
    assert run.thinned > 0
    assert sum(s.matters for s in run.steps) == 20
    assert [s.evaluations for s in run.steps] == sorted(s.evaluations for s in run.steps)
    assert run.evaluations == 1000
    assert run.counts[0].gain_px == pytest.approx(0.2)


def test_steps_are_small():
    run = begun()
    for i in range(50):
        run.add(step_of(run, 0, 5.0, 9.0, i + 1), 0.1)
    kept = {id(s.best) for s in run.steps}
    assert len(kept) == 1  # what has not changed is kept once
    assert run.steps[0].candidate.dtype == np.float32


def test_candidates_differ_and_the_best_of_those_alike_is_kept():
    run = begun()
    for px, shift_m in [(5.0, 0.0), (4.0, 0.01), (4.5, 0.02), (6.0, 0.2), (3.0, 0.4), (7.0, 0.401)]:
        run.add(step_of(run, 0, px, px, 1, shift_m=shift_m), 0.1)
    assert [(c.px, round(float(c.poses[0][0] - START[0]), 3)) for c in run.candidates] == [
        (3.0, 0.4), (4.0, 0.01), (6.0, 0.2),
    ]  # fmt: skip


def test_few_runs_of_few_frames_are_kept():
    kept = SearchRuns()
    for frame in range(20):
        for _ in range(9):
            kept.add(SearchRun(frame, [MODEL], (START,), 1.0, TrackSettings()))
    assert [r.number for r in kept.of_frame(19)] == [175, 176, 177, 178, 179, 180]
    assert kept.of_frame(3) == []
    assert kept.find(180) is kept.of_frame(19)[-1]
    assert kept.find(1) is None
