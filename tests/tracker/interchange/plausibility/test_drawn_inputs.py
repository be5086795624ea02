"""Inputs with drawn names, axes, units and lags: each is right or asked about. `QUADRILLE_PEOPLE_SEED` draws others."""

import os
from collections import Counter

import numpy as np
import pytest
from simulated_joints import N_FRAMES, SKELETONS, WRONG_M, Case, detected, skeleton_points

from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import axes_matrix, axis_conventions

FIRST_SEED = int(os.environ.get("QUADRILLE_PEOPLE_SEED", "70000"))
N_PEOPLE, N_DRAWS = 25, 16
LAGS, SCALES = (0, 0, 2, -2, 5, -5), (1.0, 1.0, 1000.0, 100.0, 1 / 0.0254)


def outcome(case):
    """One drawn input of a person: `right`, `asked` or `wrong` in silence, with its description."""
    rng = case.rng
    same_size = [m for m in SKELETONS.values() if len(m.points) == len(case.skeleton.points)]
    read_as = case.skeleton
    written = same_size[rng.integers(len(same_size))]
    if rng.random() < 0.3:
        written = written.with_sides_exchanged
    axes = ["x,y,z", *axis_conventions()][rng.integers(49) * (rng.random() < 0.7)]
    lag, scale = int(rng.choice(LAGS)), float(rng.choice(SCALES))
    clean = skeleton_points(case.person, written)
    late = np.full(clean.shape, np.nan)
    inside = slice(max(lag, 0), N_FRAMES + min(lag, 0)), slice(max(-lag, 0), N_FRAMES + min(-lag, 0))
    late[inside[0]] = clean[inside[1]]
    given = scale * detected(late, int(rng.integers(1_000_000))) @ axes_matrix(axes)
    what = f"{written.name} as {read_as.name}, axes {axes}, lag {lag}, times {scale:.4g}"
    if case.found(given, read_as):
        return "asked", what
    at = {p: i for i, p in enumerate(read_as.points)}
    stored = [(j, at[m]) for j, m in read_as.markers.items() if j in LIMB_JOINTS]
    away = [np.linalg.norm(scale * late[:, i] @ axes_matrix(axes) - case.person[j], axis=1) for j, i in stored]
    return ("right" if np.nanmean(away) < WRONG_M else "wrong"), what


@pytest.mark.slow
def test_drawn_inputs_are_right_or_asked_about():
    found, wrong = Counter(), []
    for seed in range(FIRST_SEED, FIRST_SEED + N_PEOPLE):
        case = Case(seed)
        for _ in range(N_DRAWS):
            result, what = outcome(case)
            found[result] += 1
            if result == "wrong":
                wrong.append(f"{seed}: {what}")
    assert not wrong, (found, wrong)
    assert found["right"]
