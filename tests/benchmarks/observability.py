"""Compare predicted standard deviations with errors (docs/measurements.md): `python tests/benchmarks/observability.py`.

The simulated people of `acquisition.py` are tracked with the generic body `gavrila22` of their height, whose angles are
those of the true skeleton. Each tracked pose predicts the standard deviations of its degrees of freedom; the truth
gives their errors. The noise of the prediction is calibrated on every other person, and checked on the rest.
`--scenes DIR` keeps the recordings and takes them up again.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import N_FRAMES, PLAYED
from doc_tables import Conditions, benchmark_parser, read_words, show, table, work_folder
from scipy.stats import spearmanr

from tracker.body.model import PosedBody
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.fitting.observability import OBSERVABLE_M, OBSERVABLE_RAD, ContourNoise, observe_pose
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.evidence.observer import open_observer
from tracker.formats.pose_csv import read_pose_table
from tracker.geometry.arrays import Array
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate
from tracker.simulate.experiments.contour_report import Line, line_chart

TABLES = ("observability", "observability reliability")
LENGTHS_PX = (20, 40, 80, 120, 160, 240, 320)
"""Lengths of correlated errors that are tried."""
MOST_OFF = 0.05
"""Largest share of observable degrees of freedom that may be off by three standard deviations."""
BINS_DEG = (0, 2, 3, 4, 6, 8, 12, 20, 40, 60)


class Tracked(NamedTuple):
    """A tracked person with the truth."""

    name: str
    bodies: list[PosedBody]
    """Of each frame, as tracked."""
    errors: Array
    """Estimate less truth, (n_frames, n_dofs), rad and metres."""
    cameras: tuple


class Sample(NamedTuple):
    """Predictions and errors of some people. Lengths are in metres, angles in rad."""

    sigmas: Array
    """(N, n_dofs)."""
    errors: Array
    """(N, n_dofs)."""
    observable: Array
    """(N, n_dofs)."""
    people: Array
    """Index of the person of each row, (N,)."""
    angles: Array
    """Which degrees of freedom are angles, (n_dofs,)."""

    @property
    def off(self) -> float:
        """Share of the observable degrees of freedom that are off by three standard deviations."""
        return float((np.abs(self.errors) > 3 * self.sigmas)[self.observable].mean())

    @property
    def rank_correlation(self) -> float:
        """Rank correlation over every angle of every frame."""
        return float(spearmanr(self.sigmas[:, self.angles].ravel(), np.abs(self.errors)[:, self.angles].ravel())[0])

    @property
    def rank_correlation_rms(self) -> float:
        """Rank correlation over every angle of every person, root mean squares over the frames."""
        rms = [
            [np.sqrt((a[self.people == p][:, self.angles] ** 2).mean(axis=0)) for p in np.unique(self.people)]
            for a in (self.sigmas, self.errors)
        ]
        return float(spearmanr(*map(np.concatenate, rms))[0])

    @property
    def ceiling(self) -> float:
        """Rank correlation that errors drawn from the predicted distribution would have."""
        sigmas = self.sigmas[:, self.angles].ravel()
        return float(spearmanr(sigmas, np.abs(sigmas * np.random.default_rng(0).standard_normal(len(sigmas))))[0])


def track(folder: Path, name: str) -> Tracked:
    """Track a person from the true pose of frame 0."""
    scene, seed = PLAYED[name]
    if not (folder / name).exists():
        simulate(folder / name, Simulation(scene, n_frames=N_FRAMES, seed=seed, person=name))
    session = load_session(folder / name)
    model = session.people[0].model
    truth = read_pose_table(folder / name / "truth.csv").values_for(model)
    with open_observer(session.cameras) as observer:
        run = TrackingRun(observer, Subjects.of([model]), [truth[0]], range(session.n_frames), session.fps)
        poses = [e.poses[0] for e in ChamferTracker().estimates(run)]
    errors = np.array([model.difference(p, t) for p, t in zip(poses, truth, strict=True)])
    turns = np.where(model.dof_is_length, 0.0, np.round(errors / (2 * np.pi)) * 2 * np.pi)
    return Tracked(name, [PosedBody(model, p) for p in poses], errors - turns, observer.working_cameras)


def sample(people: Sequence[Tracked], noise: ContourNoise) -> Sample:
    """Predict the standard deviations of all frames."""
    found = [observe_pose([b], t.cameras, noise=noise) for t in people for b in t.bodies]
    return Sample(
        np.array([o.sigmas for o in found]),
        np.concatenate([t.errors for t in people]),
        np.array([o.is_observable for o in found]),
        np.repeat(np.arange(len(people)), [len(t.bodies) for t in people]),
        ~found[0].model.dof_is_length,
    )


def calibrated(people: Sequence[Tracked]) -> ContourNoise:
    """The shortest length of correlated errors with which few enough degrees of freedom are off."""
    for length_px in LENGTHS_PX:
        noise = ContourNoise(length_px=length_px)
        print(f"{length_px} px: {sample(people, noise).off:.3f} off by three standard deviations")
        if sample(people, noise).off <= MOST_OFF:
            return noise
    raise SystemExit("no length is long enough")


def reliability(found: Sample) -> list[tuple[str, float, float, int]]:
    """Mean predicted and real RMS of the angles by their prediction, degrees."""
    sigmas = np.degrees(found.sigmas[:, found.angles]).ravel()
    errors = np.degrees(found.errors[:, found.angles]).ravel()
    rows = []
    for low, high in pairwise(BINS_DEG):
        at = (sigmas >= low) & (sigmas < high)
        if at.sum() >= 20:
            rms = [float(np.sqrt((a[at] ** 2).mean())) for a in (sigmas, errors)]
            rows.append((f"{low} to {high}", *rms, int(at.sum())))
    return rows


def conditions(noise: ContourNoise) -> Conditions:
    """Return the conditions of the measurement."""
    return Conditions(
        footage="the simulated people of `acquisition.py`, four cameras with backgrounds",
        body="`gavrila22` of the true height",
        start="true pose of frame 0",
        settings=f"defaults of the tracker. The length of correlated errors is {noise.length_px:.0f} px, the shortest "
        f"of {', '.join(map(str, LENGTHS_PX))} px with which at most {100 * MOST_OFF:.0f}% of the observable degrees "
        "of freedom are off by three standard deviations. Observable is a standard deviation of at most "
        f"{np.degrees(OBSERVABLE_RAD):.0f} degrees or {100 * OBSERVABLE_M:.0f} cm",
        chosen="that length, on the half that is calibrated on; nothing is fitted to the half that is checked",
        command="python tests/benchmarks/observability.py --write docs/measurements.md",
    )


def figures(samples: Mapping[str, Sample], people: Mapping[str, Sequence[Tracked]]) -> dict[str, list[str]]:
    """Return the rows of the first table: cells of the calibrated and the checked half."""
    rows = {"people": [", ".join(t.name.replace("_", " ") for t in half) for half in people.values()]}
    figures = {
        "rank correlation, every angle of every frame": lambda s: f"{s.rank_correlation:.2f}",
        "the same for errors drawn from the prediction": lambda s: f"{s.ceiling:.2f}",
        "rank correlation, RMS of every angle of every person": lambda s: f"{s.rank_correlation_rms:.2f}",
        "observable": lambda s: f"{100 * s.observable.mean():.0f}%",
        "of these off by three standard deviations": lambda s: f"{100 * s.off:.1f}%",
    }
    return rows | {name: [value(s) for s in samples.values()] for name, value in figures.items()}


def main() -> None:
    """Measure and write the section."""
    words = read_words(benchmark_parser(__doc__, scenes="folder of the recordings"), TABLES)
    with work_folder(words.scenes) as folder:
        tracked = [track(folder, person) for person in PLAYED]
    people = {"calibrated on": tracked[::2], "checked on": tracked[1::2]}
    noise = calibrated(people["calibrated on"])
    samples = {name: sample(of_them, noise) for name, of_them in people.items()}
    show(words.write, TABLES[0], conditions(noise), table([*people], figures(samples, people), ""))
    rows = reliability(samples["checked on"])
    cells = {name: [f"{predicted:.1f}", f"{error:.1f}", str(n)] for name, predicted, error, n in rows}
    heads = ("RMS predicted, deg", "RMS of the errors, deg", "angles")
    show(words.write, TABLES[1], conditions(noise), table(heads, cells, "predicted, deg"), True)
    x, errors = (np.array([row[i] for row in rows]) for i in (1, 2))
    lines = [Line("errors", errors), Line("as predicted", x, dashed=True)]
    chart = line_chart("Errors by their predicted standard deviation", x, lines, "predicted, degrees", "RMS, degrees")
    for path in words.write:
        (path.parent / "images" / "observability.svg").write_text(chart, "utf-8")


if __name__ == "__main__":
    main()
