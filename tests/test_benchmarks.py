"""Sums that the benchmarks of statuses and of the audit put into their tables."""

import importlib

import numpy as np
import pytest
from architecture import ROOT


@pytest.fixture
def benchmark_module(monkeypatch):
    """Import a benchmark as its own script does."""
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "benchmarks"))
    return importlib.import_module


def test_limbs_of_several_runs_are_pooled(benchmark_module):
    model = benchmark_module("status_model")
    rows = model.LimbRows(
        *(np.zeros((2, 8)), np.array([120.0, np.nan]), np.array([120.0, 120.0])),
        *(np.zeros(2, int), np.zeros(2, int), np.zeros(2, bool), np.zeros(2, bool)),
    )
    run = model.Run("walk", ("man",), "", "generic", True, rows)
    odds = np.array([[0.0, np.log(1 / 3)], [5.0, 5.0]])
    probabilities, errors_mm = model.pooled([run, run._replace(searched=False)], [odds, odds], lambda r: r.searched)
    np.testing.assert_allclose(probabilities, [[0.5, 0.25]])
    np.testing.assert_allclose(errors_mm, [120.0])


def test_sums_of_the_audit_count_all_frames_of_a_group(benchmark_module):
    audit = benchmark_module("joint_errors")

    def assessed(worst_mm, flagged):
        errors = np.tile(np.array(worst_mm)[:, None], (1, 12)).astype(float)
        return audit.Assessed(errors, np.array(worst_mm) / 1000, np.array(flagged), np.array([True, False]))

    first = audit.Compared("a", assessed([50, 200], [True, False]), assessed([50, 50], [False, False]), 2.0)
    second = audit.Compared("b, man", assessed([150], [True]), assessed([150], [True]), 4.0)
    (title, cells), *others = audit.groups([first, second], {"all": ["a", "b"], "none": ["c"]}).items()
    assert (title, others) == ("all", [])
    assert dict(zip(audit.HEADS, cells, strict=True)) == {
        "frames": "3",
        "mean error, mm": "133.3 → 83.3",
        "off": "2 → 1",
        "area": "1.00 → 1.00",
        "flagged": "2 → 1",
        "flagged, yet fine": "1 → 0",
        "good, yet off": "1 → 0",
        "covered": "50%",
        "processor time": "x 3.0",
    }
