"""Settings that all trackers share: motion model, evidence, priors, recovery; and the priors and the shown
cost that follow from them."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.fitting.contour_residuals import MatchSettings
from tracker.estimation.fitting.gauss_newton import CLOSE_ENOUGH
from tracker.estimation.fitting.hypothesis import BEAM_WIDTH
from tracker.estimation.search.chamfer_cost import Outliers
from tracker.evidence.view_evidence import EdgeSettings

MAX_ITERATIONS = 15
"""Gauss-Newton iterations of a whole body."""
TOLERANCE = CLOSE_ENOUGH
"""Step at which they end, rad or metres: a tenth of a pixel on a limb."""

OWN_TRUST = 3.0
"""Factor of the standard deviations of a prediction for a pose that is refined again. They only hold it where no
contour determines it."""


@dataclass(frozen=True)
class RecoverSettings:
    """Settings of the recovery of lost limbs."""

    proposals: int = 1024
    """Poses of a limb that are ranked; a power of two, so that they fill the space evenly."""
    reach_rad: float = float(np.radians(35))
    """Spread of the proposals around the pose, rad; the other half fill the joint limits."""
    n_local_search: int = 48
    """Proposals that are improved by random perturbation, and whose contours are scored."""
    perturbations: int = 16
    """Steps tried around each proposal in a round."""
    perturbations_rad: tuple[float, ...] = tuple(np.radians([16.0, 11.0, 7.0, 4.0]).tolist())
    """Their standard deviation, rad, round by round."""
    n_limb_refined: int = 10
    """Proposals whose limb is refined alone."""
    beam_width: int = BEAM_WIDTH
    """Proposals that are refined with the whole body, and poses that are kept while the next limb is searched."""
    colors: float = 0.2
    """Weight of the colours against edges. Neighbouring pixels are correlated, so it is well below 1."""
    trust_rad: float = 1.0
    """Standard deviation of the prediction of a limb that seems lost, rad: nearly none."""


@dataclass(frozen=True)
class EstimationSettings:
    """Settings that all trackers share."""

    method: ClassVar[str]
    """Name of the method, which the store keeps with the settings."""
    predict: PredictSettings = field(default_factory=PredictSettings)
    """Motion model."""
    match: MatchSettings = field(default_factory=MatchSettings)
    """Weights of the contour residuals."""
    recover: RecoverSettings | None = field(default_factory=RecoverSettings)
    """Recovery of lost limbs; None switches it off."""
    theta_px: float | None = None
    """Outlier distance, px of the footage; None for 3% of the longer side of each image."""
    outliers: Outliers = "truncated"
    """Treatment of outliers in the chamfer cost that is shown, see `ChamferCost`."""
    segments: bool = True
    """Whether edges are accepted or refused in whole segments (GD96 Sect. 4.2), and static ones are refused."""
    edges: EdgeSettings = field(default_factory=EdgeSettings)
    """Which edges are found and accepted."""
    trust_rad: float = 0.15
    """Standard deviation of the prediction of an angle, rad."""
    trust_m: float = 0.05
    """Standard deviation of the prediction of a position, metres."""
    occlusion: bool = True
    """Whether people occlude each other and edges are assigned; else each is tracked as if alone."""
    rounds: int = 2
    """Largest number of rounds in which all people are refined again with the others where they were found, and of
    turns in which the paths of a run are searched."""
    whole_run: bool = True
    """Whether the poses of all frames are estimated together at the end of a run; see `tracker.estimation.runs`."""
    apart: float = 1.0
    """Weight of the term against people passing through each other; 0 leaves it out."""
    max_iterations: int = MAX_ITERATIONS
    """Largest number of Gauss-Newton iterations of a whole body from its prediction."""
    measure_noise: bool = False
    """Whether the last refinement trusts contours more where they fit better than to a pixel, see
    `frame_problem.FrameProblem.converge`."""
    incremental_start: bool = False
    """Whether a start that does not fit is fitted chain by chain before it is searched."""

    @property
    def settles_start(self) -> bool:
        """Whether a start that the first frame contradicts is searched, see `start_pose`."""
        return self.recover is not None


def at_stride(settings: EstimationSettings, stride: int) -> EstimationSettings:
    """Return settings for every so many frames: bodies move farther between frames that are farther apart."""
    motion = settings.predict
    return replace(
        settings, trust_rad=stride * settings.trust_rad, trust_m=stride * settings.trust_m,
        predict=replace(motion, bound_rad=stride * motion.bound_rad, bound_m=stride * motion.bound_m),
    )  # fmt: skip
