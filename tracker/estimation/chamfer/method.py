"""The descriptor of the chamfer tracker."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tracker.estimation.by_frame.options import ORDER, RECOVER, THETA, WHOLE_RUN, WINDOW
from tracker.estimation.chamfer.constants import PAPER_BODY
from tracker.estimation.tracking.method import Method, Option, PaperMode

if TYPE_CHECKING:
    from tracker.body.model import BodyModel
    from tracker.estimation.chamfer.settings import TrackSettings
    from tracker.estimation.chamfer.tracker import ChamferTracker


def _settings() -> "TrackSettings":
    from tracker.estimation.chamfer.settings import TrackSettings

    return TrackSettings()


def _paper_settings() -> "TrackSettings":
    from tracker.estimation.chamfer.paper import paper_settings

    return paper_settings()


def _require_paper_body(bodies: "Mapping[str, BodyModel]") -> None:
    from tracker.estimation.chamfer.paper import require_paper_body

    require_paper_body(bodies)


def _tracker(settings: "TrackSettings") -> "ChamferTracker":
    from tracker.estimation.chamfer.tracker import ChamferTracker

    return ChamferTracker(settings)


def _at_stride(settings: Any, stride: int) -> Any:
    from tracker.estimation.by_frame.settings import at_stride

    return at_stride(settings, stride)


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
    _settings, _tracker, (ESTIMATE, ORDER, WINDOW, RECOVER, WHOLE_RUN, THETA),
    PaperMode("Gavrila and Davis 1996", _paper_settings, PAPER_BODY, _require_paper_body), _at_stride,
)  # fmt: skip
