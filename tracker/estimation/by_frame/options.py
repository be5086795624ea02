"""Options that several methods share; see `tracker.estimation.tracking.method`."""

from dataclasses import replace
from typing import Any

from tracker.body.motion.history import HISTORY_FRAMES
from tracker.estimation.tracking.method import Option


def _with_recovery(settings: Any, on: bool) -> Any:
    from tracker.estimation.by_frame.settings import RecoverSettings

    return replace(settings, recover=(settings.recover or RecoverSettings()) if on else None)


THETA = Option(
    "theta", "Outlier distance", "outlier distance in pixels", "3% of the longer side of the image by default",
    "number", lambda s: s.theta_px, lambda s, value: replace(s, theta_px=value), is_on_page=False,
)  # fmt: skip
"""The page shows it with the settings of the search, whose cost has it too."""
ORDER = Option(
    "order", "Prediction",
    "degree of the motion model that predicts the next frame: 0 stays, 1 constant velocity, 2 constant acceleration, "
    "which overshoots on noisy poses",
    "1 by default, 2 in the chamfer method's paper, 0 in the contour method's", "choice",
    lambda s: str(s.predict.order), lambda s, value: replace(s, predict=replace(s.predict, order=int(value))),
    {"0": "Stays in place", "1": "Constant velocity", "2": "Constant acceleration"},
)  # fmt: skip
WINDOW = Option(
    "window", "Past poses", "number of poses from which the motion is predicted", "3 by default, 8 in the paper's mode",
    "whole", lambda s: s.predict.window,
    lambda s, value: replace(s, predict=replace(s.predict, window=int(value))), limits=(1, HISTORY_FRAMES),
)  # fmt: skip
"""More poses, over a quarter of a second, fit no polynomial of a person's motion. A memory keeps as many."""
RECOVER = Option(
    "recover", "Search lost limbs", "search for a limb that is not where edges and colours are", "", "switch",
    lambda s: s.recover is not None, _with_recovery,
)  # fmt: skip
WHOLE_RUN = Option(
    "whole_run", "Whole run",
    "at the end, track backward too, and estimate the poses of all frames together; keyframes stay", "", "switch",
    lambda s: s.whole_run, lambda s, on: replace(s, whole_run=on),
)  # fmt: skip
