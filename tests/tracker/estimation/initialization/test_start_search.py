"""A start in a wrong local minimum, which a fit does not leave, is searched around."""

from types import SimpleNamespace

import numpy as np
import pytest
from staging import SUIT, cameras_around, dressed, posed

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.frame_problem import FrameProblem, PersonPrior
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.initialization import start_fit
from tracker.estimation.initialization.start_fit import search_around
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34")


def off_m(body, truth):
    return float(np.linalg.norm(body.points_world - truth.points_world, axis=1).max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3, 6])
def test_a_trunk_that_turned_the_wrong_way_is_found_again(monkeypatch, seed):
    truth = PosedBody(MODEL, posed(MODEL, seed))
    views = dressed([truth], cameras_around(4), SUIT)
    monkeypatch.setattr(start_fit, "read_views", lambda *_: views)
    step = np.zeros(MODEL.n_dofs)
    turns = np.array([n.startswith(("torso", "waist", "spine", "left_hip", "right_hip")) for n in MODEL.dof_names])
    turns &= ~MODEL.dof_is_length
    step[turns] = np.random.default_rng(seed).normal(0, 0.2, turns.sum())
    wrong = PosedBody(MODEL, MODEL.clip(MODEL.retract(truth.values, step)))
    problem = FrameProblem(views, [PersonPrior(MODEL, wrong.values)], TrackSettings())
    refined = problem.converge(0, problem.refine(0, (wrong,))).body
    assert off_m(refined, truth) > 0.2
    result = search_around(SimpleNamespace(), (wrong,), 0, TrackSettings())
    assert off_m(result, truth) < 0.02


@pytest.mark.parametrize(("steps_m", "n_rounds"), [((0.3, 0.05), 2), ((0.05,), 1), ((0.3, 0.3, 0.3), 2)])
def test_the_search_ends_where_nothing_moves(monkeypatch, steps_m, n_rounds):
    steps, draws = iter(steps_m), []

    def searched(problem, person, bodies, memory, n_draws):
        draws.append(n_draws)
        return PosedBody(MODEL, bodies[person].values + next(steps) * np.eye(len(MODEL.value_names))[0]), ()

    monkeypatch.setattr(start_fit, "read_views", lambda *_: ())
    monkeypatch.setattr(start_fit, "FrameProblem", lambda *_: None)
    monkeypatch.setattr(start_fit, "search_start", searched)
    result = search_around(SimpleNamespace(), (PosedBody(MODEL, MODEL.neutral()),), 0, TrackSettings())
    assert len(draws) == n_rounds
    assert min(draws) > 0
    assert result.values[0] == pytest.approx(sum(steps_m[:n_rounds]))
