"""The descriptor of the contour tracker."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tracker.estimation.by_frame.options import ORDER, RECOVER, THETA, WHOLE_RUN, WINDOW
from tracker.estimation.tracking.method import Method, Option, PaperMode

if TYPE_CHECKING:
    from tracker.estimation.contour.settings import ContourSettings
    from tracker.estimation.contour.tracker import ContourTracker


def _settings() -> "ContourSettings":
    from tracker.estimation.contour.settings import ContourSettings

    return ContourSettings()


def _paper_settings() -> "ContourSettings":
    from tracker.estimation.contour.paper import paper_settings

    return paper_settings()


def _tracker(settings: "ContourSettings") -> "ContourTracker":
    from tracker.estimation.contour.tracker import ContourTracker

    return ContourTracker(settings)


def _with_sliding(settings: "ContourSettings", on: bool) -> "ContourSettings":
    from tracker.estimation.contour.settings import with_sliding

    return with_sliding(settings, on)


def _at_stride(settings: Any, stride: int) -> Any:
    from tracker.estimation.by_frame.settings import at_stride

    return at_stride(settings, stride)


IMAGE_CONTOURS = Option(
    "image_contours", "Image contours", "the contours in the image that the model's are compared with",
    "edges by default, silhouettes in the paper's mode", "choice", lambda s: s.image_contours,
    lambda s, value: replace(s, image_contours=value), {"edges": "Edges", "silhouettes": "Silhouettes"},
)  # fmt: skip
SLIDING = Option(
    "sliding", "Sliding term", "whether the Jacobian has the term of contours that slide on the surface", "", "switch",
    lambda s: s.sliding, _with_sliding,
)  # fmt: skip
CONTOUR = Method(
    "contour", "Extremal contours",
    "extremal contours, refined by Gauss-Newton until it converges, without a search of whole bodies",
    _settings, _tracker, (IMAGE_CONTOURS, SLIDING, ORDER, WINDOW, RECOVER, WHOLE_RUN, THETA),
    PaperMode("Knossow, Ronfard and Horaud 2008", _paper_settings), _at_stride,
)  # fmt: skip
