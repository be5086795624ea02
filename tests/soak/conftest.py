"""What the soak tests share: the number of cases, and the line that reports them.

`QUADRILLE_SOAK` is a factor of the number of cases: 1 is the full number, the default is a small part of it.
"""

import os

import pytest

FACTOR = float(os.environ.get("QUADRILLE_SOAK", "0.05"))


@pytest.fixture
def cases():
    """Scale a full number of cases by the factor."""
    return lambda full: max(1, round(full * FACTOR))


@pytest.fixture
def report(capfd):
    """Print a line with the number of cases and of failures, also where the test passes."""

    def line(text):
        with capfd.disabled():
            print(f"\nsoak: {text}", flush=True)

    return line
