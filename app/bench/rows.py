"""The measurements of `quadrille bench`: one function for each row, timed between runs of the yardstick."""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from app.bench.opencv_oracle import PaintedCost
from app.bench.sample_frames import BenchCrowd, BenchFrame, pose_at
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import Fit, PosePrior, ResidualBlock, damped_step
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled
from tracker.estimation.search.best_first import COARSE_SEARCH, SearchSettings, search
from tracker.estimation.tracking.tracker import Subjects, TrackerSettings, TrackingRun
from tracker.evidence.contours import occluding_contours
from tracker.evidence.observer import open_observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array, FloatArray
from tracker.pipeline.methods import make_tracker
from tracker.session.session import Session

_CANDIDATES = 100
_PIPELINE_FRAMES = range(5, 45)
_SETTINGS = TrackSettings()
_SEARCH = _SETTINGS.search
CORES = 2
"""Number of cores on which requirements are stated by the clock, for work that uses several."""
_QUIET_YARDSTICK_MS = 1.5
"""Time of the yardstick on the quiet machine on which requirements are stated, ms."""


class Row(NamedTuple):
    """One measured piece of work."""

    name: str
    what: str
    time_us: float
    """Median processor time of all threads, microseconds."""
    clock_us: float
    """Median time by the clock, microseconds."""
    yardstick_us: float
    """Median processor time of the yardstick between the runs, microseconds."""
    must: float | None = None
    """Largest allowed processor time, in yardsticks; None for rows that are only for comparison."""
    aim: float | None = None
    """Desired processor time, in yardsticks."""
    note: str = ""

    @property
    def ratio(self) -> float:
        """Processor time in yardsticks."""
        return self.time_us / self.yardstick_us

    @property
    def busy_cores(self) -> float:
        """Mean number of cores that the work kept busy; less than one where other programs interrupted it."""
        return self.time_us / self.clock_us


class Timed(NamedTuple):
    """Median times of some work and of the yardstick, microseconds."""

    work_us: float
    """Processor time of the work, all threads."""
    clock_us: float
    """Time of the work by the clock."""
    yardstick_us: float
    """Processor time of the yardstick."""

    def scaled(self, share: float) -> "Timed":
        """Return the times of a share of the work."""
        return self._replace(work_us=share * self.work_us, clock_us=share * self.clock_us)


class Yardstick:
    """The unit of all times: a distance transform (L2, 5x5) of a 640x480 image on one thread.

    Processor times are compared: other programs interrupt a long work more often than the yardstick, so that by the
    clock the ratio grows with their load.
    """

    def __init__(self) -> None:
        """Scatter edges over the image."""
        edges = np.random.default_rng(0).random((480, 640)) < 0.02
        self._image = np.where(edges, 0, 255).astype(np.uint8)

    def __call__(self) -> None:
        """Do the work once."""
        cv2.distanceTransform(self._image, cv2.DIST_L2, cv2.DIST_MASK_5)

    def beside(self, work: Callable[[], object], runs: int, times: int = 1) -> Timed:
        """Time some work and the yardstick alternately, so that both meet the same load, after one untimed run.

        Args:
            work: the work to time.
            runs: number of runs.
            times: number of pieces of work in one run.
        """
        spent = np.array([[*spent_s(work), *spent_s(self)] for _ in range(runs + 1)][1:])
        work_s, clock_s, yardstick_s, _ = np.median(spent, axis=0)
        return Timed(1e6 * work_s, 1e6 * clock_s, 1e6 * yardstick_s).scaled(1 / times)

    def beside_difference(self, long: Callable[[], object], short: Callable[[], object], runs: int) -> Timed:
        """Time the difference between two works, alternately with the yardstick; otherwise as `beside`."""
        more_s = list[Array]()
        timed = self.beside(lambda: more_s.append(spent_s(long) - spent_s(short)), runs)
        work_s, clock_s = np.median(more_s[1:], axis=0)
        return timed._replace(work_us=1e6 * work_s, clock_us=1e6 * clock_s)


def spent_s(work: Callable[[], object]) -> Array:
    """Do some work; return its processor time, of all threads, and its time by the clock, (2,), s."""
    before = np.array([time.process_time(), time.perf_counter()])
    work()
    return np.array([time.process_time(), time.perf_counter()]) - before


def in_yardsticks(clock_ms: float, cores: int = 1) -> float:
    """Return the processor time, in yardsticks, of a requirement by the clock of the quiet machine.

    Args:
        clock_ms: the required time, ms.
        cores: number of cores that the work can keep busy.
    """
    return cores * clock_ms / _QUIET_YARDSTICK_MS


def candidates(frame: BenchFrame, cones: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """One candidate pose: kinematics, visible contours, both directions, all views, one core."""
    bodies = (("superquadrics", frame, 15, 25), ("cones", cones, 28, 50))
    for name, of, must, aim in bodies:
        cost, poses = of.cost(threads=1), of.candidates(_CANDIDATES)
        timed = yardstick.beside(partial(cost.of_person, 0, poses, [of.values]), 60, _CANDIDATES)
        yield Row(f"candidate_{name}", f"one candidate pose, {name}, 4 views", *timed, 1 / must, 1 / aim)
    painted = PaintedCost(frame.views, frame.model, frame.cost().edge_points_px)
    poses, cost = frame.candidates(20), frame.cost()
    timed = yardstick.beside(lambda: [painted(p) for p in poses], 5, len(poses))
    off = np.mean([abs(painted(p) - cost([p]).total_px) for p in poses])
    yield Row(
        "candidate_painted", "the same with numpy and OpenCV painting", *timed, note=f"{off:.2f} px off on average"
    )


def crowds(crowd: BenchCrowd, yardstick: Yardstick) -> Iterator[Row]:
    """One candidate pose of one person: alone, with one other, with two others. Costs should add up."""
    alone, poses = 0.0, crowd.candidates(_CANDIDATES)
    for n, name, must in ((1, "one person", None), (2, "two people", 2.3), (3, "three people", 3.5)):
        cost = crowd.cost(n)
        timed = yardstick.beside(partial(cost.of_person, 0, poses, crowd.values[:n]), 60, _CANDIDATES)
        row = Row(f"candidate_of_{n}", f"one candidate pose among {name}, superquadrics, 4 views", *timed)
        alone = alone or row.ratio
        if must is not None:
            row = row._replace(must=must * alone, aim=n * alone, note=f"{row.ratio / alone:.2f} times that of one")
        yield row


def searches(frame: BenchFrame, cones: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """Best-first search and refinement from a bad prediction; refinement alone from a good one."""
    for name, of in (("cones", cones), ("superquadrics", frame)):
        start = of.hard_prediction()
        steps = list(search(of.cost(start), [start], COARSE_SEARCH))
        fit = _refined(of, steps[-1].best[0], start)
        timed = yardstick.beside(partial(_searched_and_refined, of, start), 9)
        note = f"{steps[-1].evaluations} poses scored; {_apart(of, start, fit)}"
        must, aim = in_yardsticks(25, CORES), in_yardsticks(12, CORES)
        yield Row(f"search_hard_{name}", f"hard frame: search and refinement, {name}", *timed, must, aim, note)
        start = of.near_prediction()
        fit = _refined(of, start, start)
        timed = yardstick.beside(partial(_refined, of, start, start), 15)
        note = f"{fit.iterations} iterations; {_apart(of, start, fit)}"
        must, aim = in_yardsticks(8), in_yardsticks(4)
        yield Row(f"refine_tracked_{name}", f"tracked frame: refinement, {name}", *timed, must, aim, note)


def _searched(frame: BenchFrame, start: Array, settings: SearchSettings = _SEARCH) -> Array:
    *_, last = search(frame.cost(start), [start], settings)
    return last.best[0]


def _searched_and_refined(frame: BenchFrame, start: Array) -> Fit:
    return _refined(frame, _searched(frame, start, COARSE_SEARCH), start)


def _refined(frame: BenchFrame, start: Array, predicted: Array) -> Fit:
    """Refine as the tracker does; see `tracker.estimation.by_frame.frame_estimator`."""
    model = frame.model
    match = ContourResiduals(frame.views, [PosedBody(model, start)])
    sigma = np.where(model.dof_is_length, _SETTINGS.trust_m, _SETTINGS.trust_rad)
    blocks: list[ResidualBlock] = [match, PosePrior(predicted, 1 / sigma)]
    return solve_compiled(model, start, blocks, max_iterations=15, tolerance=1e-3)


def _apart(frame: BenchFrame, start: Array, fit: Fit) -> str:
    """Format the distances of the body's points from the true joints, at the start and after the fit."""
    true = frame.model.points_world(frame.values)
    off = [np.linalg.norm(frame.model.points_world(v) - true, axis=1).mean() for v in (start, fit.pose)]
    return f"{1000 * off[0]:.0f} mm off, then {1000 * off[1]:.0f}"


def iterations(cones: BenchFrame, six: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """One iteration of the symmetric Gauss-Newton: as the tracker runs it, step by step, and by a numeric Jacobian."""
    for name, of, must, aim in (("4", cones, 12, 18), ("6", six, 8, 12)):
        start = of.near_prediction()
        match = ContourResiduals(of.views, [PosedBody(of.model, start)])
        steps = np.random.default_rng(3).normal(scale=0.005, size=(50, of.model.n_dofs))
        poses = [of.model.retract(start, step) for step in steps]
        # The difference between long and short descents leaves out what a descent costs besides its iterations.
        few, many = (partial(descended, of.model, match, poses, n) for n in (2, 6))
        n, timed = many() - few(), yardstick.beside_difference(many, few, 30)
        timed = timed.scaled(1 / n)
        yield Row(f"iteration_{name}_views", f"Gauss-Newton iteration, cones, {name} views", *timed, 1 / must, 1 / aim)
        timed = yardstick.beside(partial(_stepped, of.model, match, poses), 30, len(poses))
        yield Row(f"iteration_{name}_views_readable", "the same as `gauss_newton.solve` takes it", *timed)
    start, edges_px = cones.near_prediction(), cones.cost(cones.near_prediction()).edge_points_px

    def residuals(values: Array) -> Array:
        return np.concatenate(edge_distances(cones.views, edges_px, PosedBody(cones.model, values)))

    timed = yardstick.beside(lambda: least_squares(residuals, start, method="trf", max_nfev=2), 5, 2)
    yield Row("iteration_scipy", "the same by scipy's least_squares with numeric Jacobian, edges to contour", *timed)


def descended(model: BodyModel, match: ContourResiduals, poses: Sequence[Array], most: int) -> int:
    """Descend from some poses, (n_values,) each, and return the number of iterations, at most `most`."""
    return sum(solve_compiled(model, pose, [match], max_iterations=most, tolerance=0.0).iterations for pose in poses)


def _stepped(model: BodyModel, match: ContourResiduals, poses: Sequence[Array]) -> None:
    """Linearize at some poses, (n_values,) each, and compute the step from there."""
    for values in poses:
        normal = match.linearize(model, values, model.kinematics(values))
        damped_step(normal.hessian, normal.gradient, 1e-3 * np.diag(normal.hessian) + 1e-9)


def edge_distances(views: Sequence[ViewEvidence], edges_px: Sequence[FloatArray], body: PosedBody) -> list[Array]:
    """Distance of each edge point, (n, 2) px, to the nearest visible piece of contour, cut off, (n,) for each view."""
    out: list[Array] = []
    for view, points_px in zip(views, edges_px, strict=True):
        contour = occluding_contours.trace([body], view.camera)
        pieces = contour.pieces_px[~contour.occluded]
        middles = 0.5 * (pieces[:, :2] + pieces[:, 2:])
        squared = np.sum((points_px[:, None] - middles) ** 2, axis=-1).min(axis=1)
        out.append(np.minimum(np.sqrt(squared), view.theta_px))
    return out


def evolution(cones: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """CMA-ES on the hard frame with the same evaluator and as many poses as the search; empty without `cma`."""
    try:
        import cma
    except ImportError:  # a development extra
        return
    model, start = cones.model, cones.hard_prediction()
    cost = cones.cost(start)
    steps = list(search(cost, [start], _SEARCH))
    sigma = np.where(model.dof_is_length, 0.05, np.radians(8))

    def run() -> float:
        options = {"verbose": -9, "seed": 5, "maxfevals": steps[-1].evaluations, "popsize": 40}
        strategy = cma.CMAEvolutionStrategy(np.zeros(model.n_dofs), 1.0, options)
        while not strategy.stop():
            asked = strategy.ask()
            poses = np.stack([model.move(start, sigma * step) for step in asked])
            strategy.tell(asked, cost.of_person(0, poses, [start])[0])
        return float(strategy.result.fbest)

    note = f"cost {run():.2f} px where the search ends at {steps[-1].best_px:.2f}"
    timed = yardstick.beside(run, 3)
    yield Row("cma_hard", f"hard frame by CMA-ES, {steps[-1].evaluations} poses, cones", *timed, note=note)
    timed = yardstick.beside(lambda: _searched(cones, start), 9)
    yield Row("search_alone_hard", "hard frame by best-first search alone, cones", *timed)


def pipeline(frame: BenchFrame, yardstick: Yardstick) -> Row:
    """From video to overlay: decode, undistort, edges, predict, refine, assess, trace contours; per frame."""
    what = "video to overlay, 4 views, per frame"
    return _pipeline("pipeline", what, frame.session, [frame.model], [frame.joints], (45, 90), yardstick)


def pipeline_of_two(crowd: BenchCrowd, yardstick: Yardstick) -> Row:
    """The same with two people."""
    what = "video to overlay, two people, 4 views, per frame"
    return _pipeline("pipeline_of_2", what, crowd.session, crowd.models, crowd.joints, (25, 50), yardstick)


def _pipeline(
    name: str,
    what: str,
    session: Session,
    models: Sequence[BodyModel],
    joints: Sequence[MarkerTable],
    per_second: tuple[float, float],
    yardstick: Yardstick,
) -> Row:
    """Track a session from the fitted poses; `per_second` are the required and the desired frames per second."""
    timed, note = tracked_pipeline(_SETTINGS, session, models, joints, yardstick)
    must, aim = (in_yardsticks(1e3 / fps, CORES) for fps in per_second)
    return Row(name, what, *timed, must, aim, note)


def tracked_pipeline(
    settings: TrackerSettings,
    session: Session,
    models: Sequence[BodyModel],
    joints: Sequence[MarkerTable],
    yardstick: Yardstick,
) -> tuple[Timed, str]:
    """Track a session from the fitted poses, and return the times of a frame and the frames per second in words."""
    wanted = [k for k in _PIPELINE_FRAMES if k < session.n_frames]
    first = [pose_at(j, m, wanted[0]) for j, m in zip(joints, models, strict=True)]
    n, spent = len(wanted), list[Array]()

    def run() -> None:
        with open_observer(session.cameras) as observer:
            tracked = make_tracker(settings).estimates(TrackingRun(observer, Subjects.of(models), first, wanted))
            next(tracked)  # opening the videos does not count

            def rest() -> None:
                for found in islice(tracked, n - 1):
                    bodies = [PosedBody(m, p) for m, p in zip(models, found.poses, strict=True)]
                    for camera in observer.working_cameras:
                        occluding_contours.trace(bodies, camera)

            spent.append(spent_s(rest))

    timed = yardstick.beside(run, 3)
    work_us, clock_us = 1e6 * np.median(spent[1:], axis=0) / (n - 1)
    note = f"{1e6 / clock_us:.1f} frames per second, {CORES * 1e6 / work_us:.1f} with {CORES} cores kept busy"
    return timed._replace(work_us=work_us, clock_us=clock_us), note
