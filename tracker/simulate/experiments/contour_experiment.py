"""The simulated experiment of KRH08 Sect. 6: six cameras, 120 frames, and a motion of every degree of freedom."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.contour.paper import paper_settings
from tracker.estimation.tracking.tracker import TrackerSettings
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array
from tracker.simulate.experiments.contour_run import RunResult, Scene, track_scene
from tracker.simulate.experiments.convergence import Convergence, RoughStep, fit_from_guess, measure_convergence
from tracker.simulate.experiments.smooth_motion import smooth_motion
from tracker.simulate.experiments.staged_views import ModelActor, SkinActor
from tracker.simulate.people.outfit import Outfit
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin
from tracker.simulate.stage.camera_rig import make_cameras

ActorKind = Literal["own shape", "skinned person"]
ACTORS: tuple[ActorKind, ...] = ("own shape", "skinned person")
_BODIES: Mapping[ActorKind, str] = {"own shape": "knossow54", "skinned person": "gavrila22_cones"}
"""The fitted body. The skinned person has the joints of `gavrila22` in other proportions."""
_SKELETON = "gavrila22"
_HEIGHT_M = 1.75
_SIZE = (640, 480)
FPS = 30.0
PAPER, _NO_SLIDING = "contour, paper", "contour, paper, no sliding"
"""Names of the runs in the paper's mode, with and without the sliding term in the Jacobian."""


@dataclass(frozen=True)
class ContourExperiment:
    """Parameters of the experiment."""

    n_frames: int = 120
    """Number of frames."""
    n_cameras: int = 6
    """Number of cameras of the main run."""
    camera_counts: tuple[int, ...] = (1, 2, 3, 4, 6, 8)
    """Numbers of cameras that are compared."""
    noise_px: float = 0.0
    """Noise of the contours across themselves, px; the paper adds none."""
    seed: int = 0
    """Seed of motion, cameras and noise."""

    def check(self) -> None:
        """Check the parameters.

        Raises:
            TrackerError: a number is not possible.
        """
        counts = (self.n_cameras, *self.camera_counts)
        if self.n_frames < 2 or min(counts) < 1 or max(counts) > 32 or not 0 <= self.noise_px <= 20:
            raise TrackerError(
                f"expected at least 2 frames, 1 to 32 cameras and a noise of 0 to 20 px, found {self.n_frames} frames, "
                f"{', '.join(map(str, counts))} cameras and {self.noise_px:g} px"
            )


class Comparison(NamedTuple):
    """One run of the comparison of camera counts."""

    actor: ActorKind
    n_cameras: int
    method: str
    """Name of the settings."""
    result: RunResult


class ExperimentResult(NamedTuple):
    """Everything that the report shows."""

    experiment: ContourExperiment
    models: Mapping[ActorKind, BodyModel]
    """The fitted bodies."""
    truth: Array
    """True poses of the main run, (n_frames, n_values)."""
    runs: Sequence[Comparison]
    """All runs, for each actor, method and number of cameras."""
    no_sliding: Mapping[str, RunResult]
    """The main run in the paper's mode without the sliding term, by what the report calls it."""
    convergence: Sequence[Convergence]
    """Fits on the main run's scene, see `measure_convergence`."""
    rough: tuple[Sequence[RoughStep], Sequence[RoughStep]]
    """Steps from a rough guess on its first frame, see `fit_from_guess`."""

    def main(self, method: str) -> RunResult:
        """Return the main run of a method: the model's own shape, with the paper's number of cameras."""
        wanted = ("own shape", self.experiment.n_cameras, method)
        return next(r.result for r in self.runs if (r.actor, r.n_cameras, r.method) == wanted)


def count_runs(experiment: ContourExperiment, n_methods: int) -> int:
    """Return the number of runs that `run_contour_experiment` reports for a number of methods."""
    return len({*experiment.camera_counts, experiment.n_cameras}) * len(ACTORS) * (n_methods + 1) + 2


def run_contour_experiment(
    experiment: ContourExperiment,
    methods: Mapping[str, TrackerSettings],
    progress: Callable[[int, int], None] | None = None,
) -> ExperimentResult:
    """Track the synthetic recordings with every method, in the paper's mode too, and every number of cameras.

    Args:
        experiment: its parameters.
        methods: settings of trackers by the name that the report uses.
        progress: called with the number of runs that are done and that of all.

    Raises:
        TrackerError: a parameter is not possible.
    """
    experiment.check()
    counts = sorted({*experiment.camera_counts, experiment.n_cameras})
    settings = {**methods, PAPER: paper_settings("edges")}
    runs, total = list[Comparison](), count_runs(experiment, len(methods))

    def report(done: int) -> None:
        if progress is not None:
            progress(done, total)

    for actor, n, name in product(ACTORS, counts, settings):
        scene = make_scene(experiment, actor, n)
        runs.append(Comparison(actor, n, name, track_scene(scene, settings[name], experiment.seed)))
        report(len(runs))
    scene = make_scene(experiment, "own shape", experiment.n_cameras)
    no_sliding = {_NO_SLIDING: track_scene(scene, paper_settings("edges", sliding=False), experiment.seed)}
    report(total - 1)
    convergence, rough = measure_convergence(scene, experiment.seed), fit_from_guess(scene, experiment.seed)
    report(total)
    models = {actor: load_model(_BODIES[actor], _HEIGHT_M) for actor in ACTORS}
    truth = _truth(experiment, models["own shape"])
    return ExperimentResult(experiment, models, truth, runs, no_sliding, convergence, rough)


def make_scene(experiment: ContourExperiment, actor: ActorKind, n_cameras: int) -> Scene:
    """Return the synthetic recording of an actor in some cameras."""
    model = load_model(_BODIES[actor], _HEIGHT_M)
    cameras = tuple(c.pinhole for c in make_cameras(n_cameras, _SIZE, experiment.seed))
    truth = _truth(experiment, model)
    if actor == "own shape":
        return Scene(ModelActor(model), truth, model, cameras, FPS, experiment.noise_px)
    skeleton = altered_model(load_model(_SKELETON, _HEIGHT_M))
    assert skeleton.dof_names == model.dof_names
    return Scene(SkinActor(make_skin(skeleton, Outfit())), truth, model, cameras, FPS, experiment.noise_px)


def _truth(experiment: ContourExperiment, model: BodyModel) -> Array:
    return np.asarray(smooth_motion(model, experiment.n_frames, FPS, experiment.seed))
