"""`quadrille experiment`: run an experiment of a paper again, and write a report with its figures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from app.runtime.progress import Reporter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tracker.estimation.tracking.tracker import TrackerSettings


def command(
    name: Annotated[Literal["contour"], tyro.conf.Positional, tyro.conf.arg(metavar="NAME")],
    /,
    out: Path,
    frames: int = 120,
    cameras: int = 6,
    camera_counts: tuple[int, ...] = (1, 2, 3, 4, 6, 8),
    noise: float = 0.0,
    seed: int = 0,
) -> None:
    """Run an experiment of a paper again on synthetic contours, and write a report with its figures.

    Args:
        name: contour, the simulated experiment of Knossow, Ronfard & Horaud 2008.
        out: folder of the report; files of an earlier report are replaced.
        frames: number of frames.
        cameras: number of cameras of the main run.
        camera_counts: numbers of cameras to compare.
        noise: noise of the contours across themselves, px.
        seed: of motion, cameras and noise.
    """
    from tracker.simulate.experiments.contour_experiment import ContourExperiment, count_runs, run_contour_experiment
    from tracker.simulate.experiments.contour_report import write_contour_report

    experiment = ContourExperiment(frames, cameras, camera_counts, noise, seed)
    experiment.check()
    methods, reporter = _methods(), Reporter()
    with reporter.over(count_runs(experiment, len(methods)), "runs") as tick:
        found = run_contour_experiment(experiment, methods, lambda *_: tick())
    print(f"wrote {write_contour_report(out, found)}")


def _methods() -> "Mapping[str, TrackerSettings]":
    """Return the settings that are compared, by their name in the report."""
    from tracker.estimation.chamfer.settings import TrackSettings
    from tracker.estimation.contour.settings import ContourSettings

    return {"chamfer": TrackSettings(whole_run=False), "contour": ContourSettings(whole_run=False)}
