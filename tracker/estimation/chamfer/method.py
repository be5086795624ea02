"""The descriptor of the chamfer tracker."""

from dataclasses import replace

from tracker.estimation.by_frame.options import ORDER, RECOVER, THETA, WHOLE_RUN, WINDOW
from tracker.estimation.chamfer.constants import PAPER_BODY
from tracker.estimation.tracking.method import Method, Option, PaperMode, later

ESTIMATE = Option(
    "estimate", "Estimation",
    "how the pose of a frame is found from its prediction: refine fits contours to edges and searches only what it "
    "cannot fit",
    "refine by default, search in the paper's mode", "choice", lambda s: s.estimate,
    lambda s, value: replace(s, estimate=value), {"refine": "Refine, then search", "search": "Search only (GD96)"},
)  # fmt: skip
CHAMFER = Method(
    "chamfer", "Chamfer matching",
    "edges; predicted, refined by Gauss-Newton, and searched if that does not suffice",
    later(__package__, "settings", "TrackSettings"), later(__package__, "tracker", "ChamferTracker"),
    (ESTIMATE, ORDER, WINDOW, RECOVER, WHOLE_RUN, THETA),
    PaperMode("Gavrila and Davis 1996", later(__package__, "paper", "paper_settings"), PAPER_BODY,
    later(__package__, "paper", "require_paper_body")), later("tracker.estimation.by_frame", "settings", "at_stride"),
)  # fmt: skip
