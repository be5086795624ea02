"""Equations without a solution, as errors of the input."""

from collections.abc import Generator
from contextlib import contextmanager

import numpy as np

from tracker.errors import CalibrationError


@contextmanager
def solvable(advice: str) -> Generator[None, None, None]:
    """Refuse observations whose equations have no solution, or none that is finite.

    Args:
        advice: tells the user what to film instead.

    Raises:
        CalibrationError: there is none.
    """
    try:
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            yield
    except (np.linalg.LinAlgError, FloatingPointError) as error:
        raise CalibrationError(
            f"expected observations that determine the cameras, found equations without a solution ({error}); {advice}"
        ) from error
