import numpy as np
import pytest

from tracker.compute.quantiles import median, quantiles


@pytest.mark.parametrize("n", [1, 2, 5, 768, 769])
def test_quantiles_are_numpys(n):
    values = np.random.default_rng(n).normal(size=(n, 3)).astype(np.float32)
    for shares in ((0.0, 1.0), (0.25, 0.8, 0.92)):
        np.testing.assert_allclose(quantiles(values, shares), np.quantile(values, shares, axis=0), rtol=1e-6)
    np.testing.assert_allclose(median(values), np.median(values, axis=0), rtol=1e-6)
    assert median(values[:, 0]).shape == ()


def test_arguments_stay_as_they_were():
    values = np.array([3.0, 1.0, 2.0])
    assert float(median(values)) == 2
    assert values.tolist() == [3, 1, 2]
