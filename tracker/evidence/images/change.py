"""Limits of what counts as a change against the background; without kernels, for commands that start quickly."""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.quantiles import median

MIN_DIFFERENCE = 12.0
"""Smallest difference in any colour channel (of 255) that counts as a change. It lies above video noise."""
NOISE_SIGMAS = 5.0
"""Smallest difference that counts as a change, in standard deviations of the background at that pixel."""
MAX_FILL = 0.75
"""Share of the region that a silhouette fills from which it is not plausible: changed light fills all of it."""


def change_threshold(differences: NDArray[np.float32]) -> float:
    """Return the difference above which a pixel has changed, gray levels.

    The threshold follows the noise of the view. Most pixels show the background, so the median difference measures the
    noise of an unchanged pixel.

    Args:
        differences: largest difference over the channels between smoothed frame and smoothed background, at samples
            spread over the whole image, (n,).
    """
    return max(MIN_DIFFERENCE, NOISE_SIGMAS * float(median(differences)))
