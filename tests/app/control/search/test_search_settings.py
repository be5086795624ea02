"""Settings of the search as the page edits them, leaf by leaf."""

import numpy as np
import pytest

from app.control.search.search_settings import changed, differences, leaves
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.formats.model_toml import load_model

MODELS = [load_model("gavrila22")]
BEFORE = TrackSettings()


def leaf_of(settings, name):
    return next(leaf for leaf in leaves(MODELS, settings.search) if leaf.name == name)


def test_a_leaf_gets_bounds_and_steps_of_its_own_and_gives_them_back():
    arms = {"person": 0, "name": "arms"}
    after = changed(BEFORE, MODELS, {"leaf": {**arms, "bound_rad": 0.5, "step_rad": 0.05}})
    assert (leaf_of(after, "arms").bound_rad, leaf_of(after, "arms").step_rad) == (0.5, 0.05)
    assert leaf_of(after, "arms").own
    assert leaf_of(after, "legs") == leaf_of(BEFORE, "legs")
    dofs = [MODELS[0].dof_names.index(d) for d in leaf_of(after, "arms").dofs]
    bounds, steps = after.search.lattice(MODELS[0], dofs)
    assert set(bounds) == {0.5}
    assert set(steps) == {0.05}
    assert changed(after, MODELS, {"leaf": {**arms, "bound_rad": None, "step_rad": None}}) == BEFORE


def test_lengths_and_angles_of_a_leaf_are_apart():
    after = changed(BEFORE, MODELS, {"leaf": {"person": 0, "name": "torso and head", "bound_m": 0.3}})
    found = leaf_of(after, "torso and head")
    assert (found.bound_m, found.bound_rad) == (0.3, BEFORE.search.bound_rad)
    assert leaf_of(after, "arms").bound_m is None


def test_a_leaf_lists_what_is_free():
    free = [np.arange(MODELS[0].n_dofs) < 10]
    assert all("hip" not in dof for leaf in leaves(MODELS, BEFORE.search, free) for dof in leaf.dofs)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"theta_px": -1}, "theta to be above 0"),
        ({"step_rad": 0}, "step of angles to be above 0"),
        ({"bound_m": float("nan")}, "bound of positions to be 0 or more"),
        ({"passes": []}, "passes as factors"),
        ({"passes": [1, 0]}, "passes as factors"),
        ({"patience": 0}, "1 expansion or more"),
        ({"leaf": {"person": 0, "name": "arms", "step_rad": -1}}, "step of .* to be above 0"),
        ({"leaf": {"person": 0, "name": "tail", "step_rad": 1}}, "found 'tail'"),
    ],
)
def test_impossible_search_settings_are_refused(changes, why):
    with pytest.raises(TrackerError, match=why):
        changed(BEFORE, MODELS, changes)


def test_runs_are_told_apart_by_what_differs():
    after = changed(BEFORE, MODELS, {"theta_px": 12, "leaf": {"person": 0, "name": "torso and head", "bound_m": 0.3}})
    first, second = differences([BEFORE, after])
    assert (first["theta"], second["theta"]) == ("default", "12 px")
    assert (first["bound of torso x"], second["bound of torso x"]) == ("as all", "30 cm")
    assert "passes" not in first
    assert differences([after, after]) == [{}, {}]
