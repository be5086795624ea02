"""The descriptor of the contour tracker."""

from dataclasses import replace

from tracker.estimation.by_frame.options import ORDER, RECOVER, THETA, WHOLE_RUN, WINDOW
from tracker.estimation.tracking.method import Method, Option, PaperMode, later

IMAGE_CONTOURS = Option(
    "image_contours", "Image contours", "the contours in the image that the model's are compared with",
    "edges by default, silhouettes in the paper's mode", "choice", lambda s: s.image_contours,
    lambda s, value: replace(s, image_contours=value), {"edges": "Edges", "silhouettes": "Silhouettes"},
)  # fmt: skip
SLIDING = Option(
    "sliding", "Sliding term", "whether the Jacobian has the term of contours that slide on the surface", "", "switch",
    lambda s: s.sliding, later(__package__, "settings", "with_sliding"),
)  # fmt: skip
CONTOUR = Method(
    "contour", "Extremal contours",
    "extremal contours, refined by Gauss-Newton until it converges, without a search of whole bodies",
    later(__package__, "settings", "ContourSettings"), later(__package__, "tracker", "ContourTracker"),
    (IMAGE_CONTOURS, SLIDING, ORDER, WINDOW, RECOVER, WHOLE_RUN, THETA),
    PaperMode("Knossow, Ronfard and Horaud 2008", later(__package__, "paper", "paper_settings")),
    later("tracker.estimation.by_frame", "settings", "at_stride"),
)  # fmt: skip
