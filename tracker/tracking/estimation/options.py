"""Options that several methods share; see `tracker.tracking.method`."""

from dataclasses import replace
from typing import Any

from tracker.tracking.method import Option


def _with_recovery(settings: Any, on: bool) -> Any:
    from tracker.tracking.estimation.settings import RecoverSettings

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
    lambda s, value: replace(s, predict=replace(s.predict, window=int(value))), limits=(1, 8),
)  # fmt: skip
"""More than 8 poses, a quarter of a second, fit no polynomial of a person's motion. A memory keeps as many
(`person_memory`, which is not imported here: it loads kernels)."""
RECOVER = Option(
    "recover", "Search lost limbs", "search for a limb that is not where edges and colours are", "", "switch",
    lambda s: s.recover is not None, _with_recovery,
)  # fmt: skip
BACKWARD_PASS = Option(
    "backward_pass", "Backward pass",
    "at the end, track backward between two keyframes, and from the first trusted poses after a loss", "", "switch",
    lambda s: s.backward_pass, lambda s, on: replace(s, backward_pass=on),
)  # fmt: skip
SMOOTH = Option(
    "smooth", "Smooth", "at the end, smooth the poses over time; keyframes stay, lost limbs are not trusted", "",
    "switch", lambda s: s.smooth, lambda s, on: replace(s, smooth=on),
)  # fmt: skip
AUDIT = Option(
    "audit", "Audit",
    "at the end, track once more without each camera in turn: the median is the pose, and how far these tracks lie "
    "apart is its error", "", "switch", lambda s: s.audit, lambda s, on: replace(s, audit=on),
)  # fmt: skip
