"""The simulated experiment of KRH08 Sect. 6: six cameras, 120 frames, and a motion of every degree of freedom."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.experiments.contour_run import RunResult, Scene, track_scene
from tracker.experiments.convergence import Convergence, RoughStep, fit_rough_guess, measure_convergence
from tracker.experiments.smooth_motion import smooth_motion
from tracker.experiments.staged_views import ModelActor, SkinActor
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array
from tracker.simulate.people.outfit import Outfit
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.tracking.contour.paper import paper_settings
from tracker.tracking.tracker import TrackerSettings

ActorKind = Literal["own shape", "skinned person"]
ACTORS: tuple[ActorKind, ...] = ("own shape", "skinned person")
_BODIES: Mapping[ActorKind, str] = {"own shape": "knossow54", "skinned person": "gavrila22_cones"}
"""The fitted body. The skinned person has the joints of `gavrila22` in other proportions."""
_SKELETON = "gavrila22"
_HEIGHT_M = 1.75
_SIZE = (640, 480)
FPS = 30.0
_PAPER_RUNS = {"contour, paper": True, "contour, paper, no sliding": False}
"""Main runs in the paper's mode, and whether the sliding term is part of the Jacobian."""
N_PAPER_RUNS = len(_PAPER_RUNS) + 1
"""Number of runs besides those of the methods that are compared."""


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
    paper: Mapping[str, RunResult]
    """The main run in the paper's mode, by what the report calls it: with and without the sliding term."""
    convergence: Sequence[Convergence]
    """Fits with and without the sliding term, on the main run's scene."""
    rough: tuple[Sequence[RoughStep], Sequence[RoughStep]]
    """Steps from a rough guess on its first frame, see `fit_rough_guess`."""

    def main(self, method: str) -> RunResult:
        """Return the main run of a method: the model's own shape, with the paper's number of cameras."""
        wanted = ("own shape", self.experiment.n_cameras, method)
        return next(r.result for r in self.runs if (r.actor, r.n_cameras, r.method) == wanted)


def run_contour_experiment(
    experiment: ContourExperiment,
    methods: Mapping[str, TrackerSettings],
    progress: Callable[[int, int], None] | None = None,
) -> ExperimentResult:
    """Track the synthetic recordings with every method and number of cameras.

    Args:
        experiment: its parameters.
        methods: settings of trackers by the name that the report uses.
        progress: called with the number of runs that are done and that of all.

    Raises:
        TrackerError: a parameter is not possible.
    """
    experiment.check()
    counts = sorted({*experiment.camera_counts, experiment.n_cameras})
    wanted = [(actor, n, name) for actor in ACTORS for n in counts for name in methods]
    runs = list[Comparison]()
    for actor, n, name in wanted:
        scene = make_scene(experiment, actor, n)
        runs.append(Comparison(actor, n, name, track_scene(scene, methods[name], experiment.seed)))
        if progress is not None:
            progress(len(runs), len(wanted) + N_PAPER_RUNS)
    scene, paper = make_scene(experiment, "own shape", experiment.n_cameras), dict[str, RunResult]()
    for name, sliding in _PAPER_RUNS.items():
        paper[name] = track_scene(scene, paper_settings("edges", sliding), experiment.seed)
        if progress is not None:
            progress(len(wanted) + len(paper), len(wanted) + N_PAPER_RUNS)
    convergence, rough = measure_convergence(scene, experiment.seed), fit_rough_guess(scene, experiment.seed)
    if progress is not None:
        progress(len(wanted) + N_PAPER_RUNS, len(wanted) + N_PAPER_RUNS)
    models = {actor: load_model(_BODIES[actor], _HEIGHT_M) for actor in ACTORS}
    truth = _truth(experiment, models["own shape"])
    return ExperimentResult(experiment, models, truth, runs, paper, convergence, rough)


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
