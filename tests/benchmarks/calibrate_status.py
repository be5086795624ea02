"""Fit the weights of `estimation/tracking/confidence.py` and measure what statuses are worth (docs/log/accuracy.md).

Statuses follow from these weights in first passes, and searches of limbs do.

`python tests/benchmarks/calibrate_status.py --data DIR` films simulated people of ten builds, couples and a crowd, with
clutter and noise. It tracks them with the generic body of the height that their joints give, and with the body acquired
from one of the recordings: with two to eight cameras, at half the frame rate, without backgrounds, and without the
search for lost limbs. The weights are fitted to all of that. What they are worth is measured on each body by weights
fitted to the others, and on the recordings in DIR, to which nothing is fitted.

It prints the weights; they are to be copied into the code. `--write` also draws docs/images/reliability.svg. `--work
DIR` keeps scenes, bodies and features there: after a change of the tracker, remove `DIR/rows` and run it again.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from acquisition import PLAYED, RECORDED, new_session, recorded
from doc_tables import benchmark_parser, read_words, work_folder
from status_model import LimbRows, Run, load_rows, save_rows
from status_tables import write_results
from true_starts import limb_joints, track_from

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.acquisition.from_contours import AcquisitionSettings, acquire_from_contours
from tracker.estimation.acquisition.from_joints import height_from_joints, place_joints
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.tracking import confidence
from tracker.estimation.tracking.tracker import PoseEstimate
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.footage.camera_source import CameraSource
from tracker.formats.joint_maps import JOINTS, LIMB_JOINTS
from tracker.formats.model_toml import format_model, load_model, parse_model
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate

TABLES = (
    "calibrate_status groups", "calibrate_status people", "calibrate_status reliability", "calibrate_status ranking",
    "calibrate_status attainable", "calibrate_status thresholds", "calibrate_status called lost",
)  # fmt: skip
FOUR, TWO, THREE = (0, 1, 2, 3), (0, 1), (0, 1, 2)
SEVERAL_SEED, SECOND_SEED, RING_SEED = 52, 53, 51
_N_FRAMES, _RING_FRAMES = 40, 36
_FIRST = 36
"""Frames of the recordings that bodies are acquired from."""
_MIN_GOOD = 6
"""Fewest good frames for an acquisition; else all that are not lost are used."""


@dataclass(frozen=True)
class Scene:
    """A simulated recording and how it is tracked."""

    name: str
    bodies: tuple[str, ...]
    simulation: Simulation
    cameras: Mapping[int, tuple[int, ...]]
    """Indices of the cameras by their number; the first entry is that of all other conditions."""


class Footage(NamedTuple):
    """What is tracked: cameras, number of frames, rate and the true joints of each person."""

    cameras: tuple[CameraSource, ...]
    n_frames: int
    fps: float
    references: tuple[MarkerTable, ...]


SECOND = {
    "child_3": ("dance", 15.0), "heavy_man": ("dance", 15.0), "tall_thin_man": ("exercise", 15.0),
    "broad_man": ("dance", 25.0), "child_10": ("reach_and_cross", 25.0), "heavy_woman": ("exercise", 15.0),
    "long_legged_woman": ("dance", 15.0), "short_woman": ("exercise", 25.0), "child_6": ("reach_and_cross", 15.0),
    "heavy_child": ("dance", 15.0),
}  # fmt: skip
"""Scene and frame rate of the second recording of each person."""
RING = {
    "heavy_man": ("exercise", 25.0), "child_10": ("dance", 15.0), "short_woman": ("reach_and_cross", 15.0),
    "broad_man": ("leaving", 25.0),
}  # fmt: skip
"""Those of a third recording, with eight cameras around."""


def _scenes() -> Iterator[Scene]:
    """Return all scenes; those that bodies are acquired from come first."""
    views = {4: FOUR, 3: THREE, 2: TWO}
    for name, (scene, seed) in PLAYED.items():
        yield Scene(f"{name}_1", (name,), Simulation(scene, 4, _FIRST, seed, person=name), views)
    for scene in ("couple_near", "tango", "couple_touching", "crowd_of_three", "couple_overlapping"):
        crowd = scene.startswith("crowd")
        bodies = ("man of a crowd", "woman of a crowd", "man of a crowd 2") if crowd else ("man", "woman")
        views = {4: FOUR, 2: TWO} if scene in ("couple_near", "tango") else {4: FOUR}
        yield Scene(scene, bodies, Simulation(scene, 4, _N_FRAMES, SEVERAL_SEED), views)
    for name, (scene, fps) in SECOND.items():
        made = Simulation(scene, 4, _N_FRAMES, SECOND_SEED, fps=fps, person=name)
        yield Scene(f"{name}_2", (name,), made, {4: FOUR, 3: THREE})
    for name, (scene, fps) in RING.items():
        made = Simulation(scene, 8, _RING_FRAMES, RING_SEED, fps=fps, person=name)
        yield Scene(f"{name}_3", (name,), made, {4: (0, 2, 4, 6), 8: tuple(range(8)), 2: (1, 4)})


def build_of(body: str) -> str:
    """Return the name under which a body is left out: people of a crowd have the builds of the couples."""
    return body.split()[0] if "crowd" in body else body


class Pass(NamedTuple):
    """One way to track a recording."""

    condition: str
    body: str
    cameras: tuple[int, ...]
    stride: int = 1
    background: bool = True
    searched: bool = True

    @property
    def name(self) -> str:
        """Name for files."""
        return "_".join([self.body, self.condition or "plain"]).replace(" ", "_")


def passes(cameras: Mapping[int, tuple[int, ...]]) -> Iterator[Pass]:
    """List the ways to track a simulated recording."""
    main, *rest = cameras.items()
    for body in ("generic", "acquired"):
        yield Pass("", body, main[1])
        for n, indices in rest:
            yield Pass(f"{n} cameras", body, indices)
        yield Pass("half the frame rate", body, main[1], stride=2)
        yield Pass("no backgrounds", body, main[1], background=False)
    yield Pass("no search", "generic", main[1], searched=False)


def track(footage: Footage, models: Sequence[BodyModel], how: Pass) -> tuple[LimbRows, list[PoseEstimate]]:
    """Track all people from their joints in frame 0; return the rows, and the estimates."""
    truths = [limb_joints(reference)[0] for reference in footage.references]
    starts = [fit_to_points(m, t, centers=True).pose for m, t in zip(models, truths, strict=True)]
    cameras = [footage.cameras[i] for i in how.cameras]
    cameras = cameras if how.background else [replace(c, background=None, masks=None) for c in cameras]
    settings = TrackSettings() if how.searched else replace(TrackSettings(), recover=None)
    frames = range(0, footage.n_frames, how.stride)
    with open_observer(cameras) as observer:
        found = track_from(observer, models, starts, frames, settings, footage.fps / how.stride)
    people = [_rows_of(p, found, models[p], footage.references[p]) for p in range(len(models))]
    return LimbRows(*(np.array(c) for c in zip(*itertools.chain(*people), strict=True))), found


def _rows_of(
    person: int, estimates: Sequence[PoseEstimate], model: BodyModel, truth: MarkerTable
) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the limbs of one person."""
    joints = {int(f): dict(zip(truth.names, p, strict=True)) for f, p in zip(truth.frames, truth.points, strict=True)}
    for found in estimates:
        if found.qualities[person] is not None and found.frame in joints:
            errors = _errors_mm(model, joints[found.frame], found.poses[person])
            yield from _frame_rows(person, model, found, errors)


def _frame_rows(
    person: int, model: BodyModel, found: PoseEstimate, errors: Mapping[str, float]
) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of one frame."""
    quality = found.qualities[person]
    assert quality is not None
    worst = np.nanmax([errors.get(n, np.nan) for n in LIMB_JOINTS])
    for limb, of_limb in zip(limbs(model), quality.limbs, strict=True):
        error = max([errors[n] for n in _joints_of(model, limb.name) if n in errors], default=np.nan)
        own = confidence.features(quality, of_limb)
        yield own, error, worst, person, found.frame, quality.is_unseen, bool(found.alternatives[person])


def _errors_mm(model: BodyModel, truth: Mapping[str, Array], pose: Array) -> dict[str, float]:
    """Return the error of each known joint."""
    estimate = dict(zip(model.point_names, model.joint_centers_world(pose), strict=True))
    known = [n for n in JOINTS if n in estimate and n in truth and np.all(np.isfinite(truth[n]))]
    return {n: 1000 * float(np.linalg.norm(estimate[n] - truth[n])) for n in known}


def _joints_of(model: BodyModel, limb: str) -> list[str]:
    """Return the joints that tell whether a limb is off: those on its parts; neck and head for the head."""
    parts = next(x.parts for x in limbs(model) if x.name == limb)
    if limb == "head":
        return ["neck", "head"]
    return [n for n in LIMB_JOINTS if model.point_parts[model.point_names.index(n)] in parts]


def acquire(footage: Footage, models: Sequence[BodyModel], found: Sequence[PoseEstimate], person: int) -> BodyModel:
    """Acquire a body as `quadrille acquire` does after `track`: from good frames, and the joints of frame 0."""
    good = [f for f in found if f.frame == 0 or f.statuses[person] == "good"]
    if len(good) < _MIN_GOOD:
        good = [f for f in found if f.frame == 0 or f.statuses[person] != "lost"]
    people = [person, *(i for i in range(len(models)) if i != person)]
    bodies = {f.frame: tuple(PosedBody(models[i], f.poses[i]) for i in people) for f in good}
    placed = {0: place_joints(models[person], limb_joints(footage.references[person])[0])}
    with open_observer(footage.cameras) as observer:
        return acquire_from_contours(observer, bodies, 0, placed, AcquisitionSettings()).body


class Workshop:
    """Tracks recordings and keeps what is found in a folder."""

    def __init__(self, folder: Path) -> None:
        """Make the folder."""
        self._rows, self._bodies = folder / "rows", folder / "bodies"
        for path in (self._rows, self._bodies):
            path.mkdir(parents=True, exist_ok=True)

    def runs(
        self, name: str, bodies: Sequence[str], footage: Footage, cameras: Mapping[int, tuple[int, ...]],
        ways: Sequence[Pass],
    ) -> Iterator[Run]:  # fmt: skip
        """Track a recording in several ways.

        Args:
            name: of the recording.
            bodies: name of each person's body; a body that is not there yet is acquired.
            footage: the recording.
            cameras: the first entry acquires bodies.
            ways: how it is tracked.
        """
        generic = load_model(DEFAULT_MODEL)
        models = {"generic": [generic.with_height(height_from_joints(generic, t)) for t in footage.references]}
        main = footage._replace(cameras=tuple(footage.cameras[i] for i in next(iter(cameras.values()))))
        models["acquired"] = list(self._acquired(bodies, main, models["generic"]))
        for how in ways:
            path = self._rows / f"{name}_{how.name}.npz"
            if not path.exists():
                save_rows(path, track(footage, models[how.body], how)[0])
                print(f"tracked {path.stem}", flush=True)
            builds = tuple(map(build_of, bodies))
            yield Run(name, builds, how.condition, how.body, how.searched, load_rows(path))

    def _acquired(self, bodies: Sequence[str], main: Footage, generic: Sequence[BodyModel]) -> Iterator[BodyModel]:
        """Return the acquired bodies."""
        found: list[PoseEstimate] = []
        for person, body in enumerate(bodies):
            path = self._bodies / f"{body.replace(' ', '_')}.toml"
            if not path.exists():
                found = found or track(main, generic, Pass("", "generic", tuple(range(len(main.cameras)))))[1]
                path.write_text(format_model(acquire(main, generic, found, person)), "utf-8")
                print(f"acquired {body}", flush=True)
            yield parse_model(path.read_text("utf-8"), path.stem)


def simulated_runs(folder: Path, workshop: Workshop) -> Iterator[Run]:
    """Track the simulated recordings, and make those that are not there."""
    for scene in _scenes():
        at = folder / scene.name
        if not at.exists():
            simulate(at, scene.simulation)
        session = load_session(at)
        names = ["truth.trc"] if len(session.people) == 1 else [f"truth_{p.name}.trc" for p in session.people]
        truths = tuple(read_joints(at / name, session.fps) for name in names)
        footage = Footage(session.cameras, session.n_frames, session.fps, truths)
        yield from workshop.runs(scene.name, scene.bodies, footage, scene.cameras, [*passes(scene.cameras)])


def recorded_runs(data: Path, folder: Path, workshop: Workshop) -> Iterator[Run]:
    """Track the recordings of a folder."""
    for recording in recorded(data, [*RECORDED]):
        at = folder / recording.name
        session = load_session(at if at.exists() else new_session(recording, folder))
        truths = tuple(read_joints(path, session.fps) for path in recording.references.values())
        footage = Footage(session.cameras, session.n_frames, session.fps, truths)
        bodies = [f"{recording.name} {person}" for person in recording.references]
        ways = [Pass("", body, FOUR) for body in ("generic", "acquired")]
        for run in workshop.runs(recording.name, bodies, footage, {4: FOUR}, ways):
            yield run._replace(bodies=tuple(bodies))


def main() -> None:
    """Track, fit, print and write."""
    data, kept = "folder with walk, balance_real, fast_arms and two_people", "folder for scenes, bodies and features"
    words = read_words(benchmark_parser(__doc__, data=data, work=kept), TABLES)
    with work_folder(words.work) as work:
        workshop = Workshop(work)
        runs = [*simulated_runs(work / "scenes", workshop)]
        outside = [*recorded_runs(words.data, work / "sessions", workshop)] if words.data else []
    write_results(runs, outside, words.write)


if __name__ == "__main__":
    main()
