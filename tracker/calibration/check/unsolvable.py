"""Equations without a solution, and solutions that show wrong observations, as errors of the input."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from itertools import combinations

import numpy as np

from tracker.errors import CalibrationError
from tracker.geometry.camera_rig import MIN_APART_M
from tracker.geometry.cameras import Camera


def check_apart(cameras: Sequence[Camera]) -> None:
    """Check that no two cameras were found at one place, as those of one video are.

    Raises:
        CalibrationError: two were.
    """
    for one, other in combinations(cameras, 2):
        if (apart_m := float(np.linalg.norm(one.center_world - other.center_world))) < MIN_APART_M:
            raise CalibrationError(
                f"expected each camera at a place of its own, found '{one.name}' and '{other.name}' "
                f"{100 * apart_m:.1g} cm apart, as of one video under two names; leave one out"
            )


@contextmanager
def refuse_unsolvable(advice: str) -> Generator[None, None, None]:
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
