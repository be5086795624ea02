"""Fit the sizes of a body and its poses on several frames to contours, all at once (`contour_bundle`).

Priors hold sizes that no frame shows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from tracker.body.dimensions import restate_height
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.estimation.acquisition.contour_bundle import SHAPE_KINDS, SIZE_KINDS, ContourBundle, RigState, SeenPerson
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations, solve_bundle
from tracker.estimation.fitting.contour_residuals import MatchSettings
from tracker.estimation.fitting.gauss_newton import PointTargets, PosePrior
from tracker.estimation.fitting.pins import PinBlock
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import N_CORRECTIONS


class SightedPerson(NamedTuple):
    """A person on one frame, with the evidence of the views."""

    frame: int
    views: Sequence[ViewEvidence]
    """Evidence of each view that is the person's."""
    bodies: tuple[PosedBody, ...]
    """All people; the others occlude."""
    person: int
    """Index of the person among them."""
    placed: PointTargets | None = None
    """Positions of points of the body that were placed by hand or are known; None in a frame that was only tracked."""
    seen: PinBlock | None = None
    """Positions of points of the body that a user has marked in the images; None without any."""

    def moved(self, model: BodyModel, pose: Array) -> "SightedPerson":
        """Return the person with another body and pose."""
        own = PosedBody(model, pose, self.bodies[self.person].velocity)
        return self._replace(bodies=(*self.bodies[: self.person], own, *self.bodies[self.person + 1 :]))

    @property
    def pose(self) -> Array:
        """The person's pose, (n_values,)."""
        return self.bodies[self.person].values


@dataclass(frozen=True)
class Round:
    """A round of the fit, from coarse to fine."""

    kinds: tuple[str, ...]
    """Kinds of parameters that are free, see `SizePriors`."""
    reach: float
    """Outlier distance, in that of the views."""
    iterations: int = 12
    """Largest number of steps."""


_EVERY_KIND = (*SIZE_KINDS, *SHAPE_KINDS)
ROUNDS = (Round(("height", "build"), 1.5, 8), Round(SIZE_KINDS, 1.0), Round(_EVERY_KIND, 0.6, 20))
"""First the body as a whole, then its parts, then their shapes."""


@dataclass(frozen=True)
class SizeFitSettings:
    """Settings of the fit."""

    match: MatchSettings = field(default_factory=MatchSettings)
    """Weights of the contour residuals."""
    rounds: tuple[Round, ...] = ROUNDS
    trust_rad: float = 0.3
    """Standard deviation of the initial angles, rad."""
    trust_m: float = 0.1
    """Standard deviation of the initial position, metres."""
    frame_correlation: float = 0.3
    """Correlation between frames of the mean error of a part's contours: clothes and wrong shapes stay the same. It is
    0.22 to 0.65 on seven simulated people, 0.29 in the median. It widens the covariance of the sizes."""


class SizeStart(NamedTuple):
    """The start of a fit that does not begin at the body before."""

    sizes: Array
    """Parameters, (n_sizes,), see `SizeParameters`."""
    covariance: Array
    """Of the sizes, (n_sizes, n_sizes)."""
    poses: Mapping[int, Array]
    """By frame, (n_values,)."""


class SizeFit(NamedTuple):
    """Sizes and poses that fit the frames."""

    sizes: Array
    """Parameters, (n_sizes,), see `SizeParameters`."""
    body: BodyModel
    """The body with these sizes; its height is its stature."""
    poses: tuple[Array, ...]
    """Pose of each frame, (n_values,)."""
    cost: float
    """Half the weighted sum of squares, of evidence and priors."""
    covariance: Array
    """Of the sizes, (n_sizes, n_sizes), whatever the poses are."""
    n_evaluations: int = 0
    """Number of evaluations of the residuals of all frames."""


def fit_sizes_to_contours(
    parameters: SizeParameters,
    frames: Sequence[SightedPerson],
    settings: SizeFitSettings,
    start: SizeStart | None = None,
    report: Callable[[float], None] = lambda share: None,
) -> SizeFit:
    """Fit sizes and poses to the contours of several frames.

    Args:
        parameters: the sizes; their prior has the mean 0.
        frames: the frames, with the initial poses.
        settings: of the fit.
        start: initial sizes and poses; by default those of the frames. Without rounds they are returned as they are.
        report: is given the share of the work that is done, 0 to 1. An exception that it raises ends the fit.
    """
    n = len(parameters.names)
    if start is None:
        start = SizeStart(np.zeros(n), np.diag(parameters.sigmas**2), {})
    poses = tuple(start.poses.get(f.frame, f.pose) for f in frames)
    still = np.zeros((max((len(f.views) for f in frames), default=0), N_CORRECTIONS))
    state, covariance = RigState(still, (start.sizes,), poses), start.covariance
    cost, n_evaluations = np.nan, 0
    planned, done = sum(step.iterations for step in settings.rounds), 0
    for step in settings.rounds:
        body = parameters.body(state.sizes[0])
        seen = [_seen(f, body, p, settings) for f, p in zip(frames, state.poses, strict=True)]
        problem = ContourBundle(seen, [parameters], still, None, _EVERY_KIND, settings.match, step.reach)
        show = partial(_report_iteration, report, done, planned)
        found = solve_bundle(problem.with_free_sizes(*step.kinds), state, step.iterations, report=show)
        done += step.iterations
        state, cost = found.state, found.cost
        n_evaluations += found.evaluations
        if step is settings.rounds[-1]:
            covariance = _covariance(found.equations, parameters.sigmas, settings.frame_correlation)
            covariance[0, 0] += (parameters.base.height_sigma or 0.0) ** 2  # that of a fixed height, the first size
    (sizes,) = state.sizes
    body = restate_height(parameters.body(sizes), parameters.base)
    return SizeFit(sizes, body, state.poses, cost, covariance, n_evaluations)


def _seen(frame: SightedPerson, body: BodyModel, pose: Array, settings: SizeFitSettings) -> SeenPerson:
    """Return a person in a body and a pose as the first of the people on a frame, whose time is counted in frames."""
    person, trust = frame.person, np.where(body.dof_is_length, settings.trust_m, settings.trust_rad)
    bodies = (PosedBody(body, pose, frame.bodies[person].velocity), *frame.bodies[:person], *frame.bodies[person + 1 :])
    paths = tuple(PosePath.steady(np.zeros(b.model.n_dofs) if b.velocity is None else b.velocity, 1.0) for b in bodies)
    points = tuple(block for block in (frame.placed, frame.seen) if block is not None)
    ahead = [v.ahead_frames for v in frame.views]
    return SeenPerson(0, frame.views, bodies, paths, 0.0, ahead, points, PosePrior(pose, 1 / trust))


def _report_iteration(report: Callable[[float], None], done: int, planned: int, iteration: int) -> None:
    report((done + iteration) / planned)


def _covariance(equations: ArrowEquations, sigmas: Array, correlation: float) -> Array:
    """Return the covariance of the sizes, whatever the poses are, (n_sizes, n_sizes).

    Frames whose errors are alike count as n / (1 + (n - 1) correlation) independent ones, the design effect of samples
    in clusters (L. Kish, Survey Sampling, 1965). Along a contour errors are correlated over 7 px on simulated people,
    so that `MatchSettings.information_per_px` counts each contour with care already.

    Args:
        equations: of the fit, by the sizes and the pose of each frame.
        sigmas: standard deviations of the sizes in the prior, which the equations contain, (n_sizes,).
        correlation: of the errors of two frames.
    """
    precision = np.diag(1 / sigmas**2)
    of_frames = equations.reduced()[1] - precision
    design_effect = 1 + (len(equations.cross) - 1) * correlation
    return np.asarray(np.linalg.inv(precision + of_frames / design_effect), dtype=np.float64)
