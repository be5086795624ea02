"""Limits of what counts as a change against the background; without kernels, for commands that start quickly."""

MIN_DIFFERENCE = 12.0
"""Smallest difference in any colour channel (of 255) that counts as a change. It lies above video noise."""
NOISE_SIGMAS = 5.0
"""Smallest difference that counts as a change, in standard deviations of the background at that pixel."""
MAX_FILL = 0.75
"""Share of the region that a silhouette fills from which it is not plausible: changed light fills all of it."""
