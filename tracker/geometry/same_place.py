"""When two places are the same. Loads nothing, so that options of trackers name it before a kernel is compiled."""

INLIER_M = 0.10
"""Distance from a point, metres, within which a view's observation is of it. Poses that differ by no more are the same
pose elsewhere (`tracker.estimation.fitting.hypothesis`): a limb is about as thick."""
