"""Settings of the contour tracker."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.fitting.contour_residuals import MatchSettings
from tracker.estimation.fitting.gauss_newton import MAX_ITERATIONS

ImageContours = Literal["edges", "silhouettes"]


@dataclass(frozen=True)
class ContourSettings(EstimationSettings):
    """Settings of the contour tracker."""

    method: ClassVar[str] = "contour"
    """Name of the method, which the store keeps with the settings."""
    match: MatchSettings = field(default_factory=lambda: MatchSettings(motion="sliding"))
    """Weights of the contour residuals, with the motion of contour points in full."""
    max_iterations: int = MAX_ITERATIONS
    """Largest number of Gauss-Newton iterations of a whole body."""
    measure_noise: bool = True
    """See `EstimationSettings.measure_noise`."""
    incremental_start: bool = True
    """Whether a start that does not fit is fitted chain by chain."""
    image_contours: ImageContours = "edges"
    """Evidence that contours are compared with: `edges`, together with silhouettes in the default mode, or
    `silhouettes` alone. A view without a silhouette keeps its edges."""
    paper: bool = False
    """Whether KRH08 Eq. 60 is minimized alone: model to image, without robust weights, prior and recovery."""

    @property
    def sliding(self) -> bool:
        """Whether the sliding term B of KRH08 Eq. 31 is part of the Jacobian."""
        return self.match.motion == "sliding"

    @property
    def settles_start(self) -> bool:
        """See `EstimationSettings.settles_start`; the paper's mode fits its start chain by chain."""
        return self.recover is not None and not self.paper


def with_sliding(settings: ContourSettings, sliding: bool) -> ContourSettings:
    """Return the settings with the sliding term switched on or off."""
    return replace(settings, match=replace(settings.match, motion="sliding" if sliding else "rigid"))
