"""How much of a motion is kept. Loads nothing, so that options of trackers name it before a kernel is compiled."""

HISTORY_FRAMES = 8
"""Number of poses that are kept: the longest window of a prediction, T of GD96 Sect. 4.2, which is not stated there. A
parabola through fewer poses amplifies the noise of a lattice of 5 degrees: the variance of the prediction is 2 times
that of a pose with 8 poses, and 19 times with 3."""
