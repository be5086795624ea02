"""Compare the cost of tracked poses with that of poses refined from the truth: is the search at fault, or the cost?

`python tests/benchmarks/true_pose_costs.py --data DIR` writes a table of docs/decisions/by_frame.md. Simulated people
dance; the recordings in DIR are added. Each is tracked with the generic body of the height that the true joints give,
from the pose fitted to those of frame 0. On every frame the pose fitted to the true joints is refined twice on the same
evidence. Where this pose costs less than the tracked one, the search has missed it. The cost is that of contours, joint
spreads and penetration, without the prediction. The poses lie in one valley where no pose on the straight line between
them costs more than both. `--work DIR` keeps the simulated recordings.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import new_session, recorded
from calibrate_status import SECOND, SECOND_SEED
from doc_tables import Conditions, benchmark_parser, read_words, show, table, work_folder
from true_starts import joint_centers, limb_joints, track_from

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.acquisition.from_joints import height_from_joints
from tracker.estimation.by_frame.frame_problem import prediction_sigmas
from tracker.estimation.by_frame.pose_score import common_evidence, scorer_without_prediction
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer, open_observer
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import Session, load_session
from tracker.simulate import Simulation, simulate

TABLES = ("true_pose_costs",)
HEADS = (
    "frames",
    "at most that cost",
    "at most 1% more",
    "the rest in another valley",
    "error, mm",
    "from the truth, mm",
)
RECORDED = ("walk", "fast_arms")
N_FRAMES = 40
_ROUGH = 1.0
"""A rise along the line between two poses below which they lie in one valley, nats: the cost is rough."""
_ON_LINE = 21
"""Poses on that line whose cost is computed."""
_SAME = 1e-3
"""A difference of the cost that does not count, nats."""


class Dancer(NamedTuple):
    """A recording of one person with known joints."""

    name: str
    session: Session
    model: BodyModel
    joints: dict[int, dict[str, Array]]
    """True limb joints by frame and name, (3,) each, metres."""


class FrameResult(NamedTuple):
    """The two poses of a frame."""

    excess: float
    """Cost of the tracked pose above that of the pose refined from the truth, nats."""
    cost: float
    """Cost of the latter, nats."""
    barrier: float
    """How far the cost rises between the two above the larger of their costs, nats."""
    error_mm: float
    """Mean error of the limb joints of the tracked pose."""
    error_from_truth_mm: float
    """The same of the pose refined from the truth."""


def dancers(folder: Path, data: Path | None) -> Iterator[Dancer]:
    """Make the simulated sessions that are not there, and list all recordings."""
    for name, (scene, fps) in SECOND.items():
        if scene != "dance":
            continue
        at = folder / "scenes" / f"{name}_2"
        if not at.exists():
            simulate(at, Simulation(scene, 4, N_FRAMES, SECOND_SEED, fps=fps, person=name))
        yield read_dancer(name, at, at / "truth.trc")
    for recording in recorded(data, RECORDED) if data else ():
        at = folder / "sessions" / recording.name
        if not at.exists():
            new_session(recording, at.parent)
        yield read_dancer(recording.name, at, recording.references["person"])


def read_dancer(name: str, folder: Path, reference: Path) -> Dancer:
    """Read a session and its true joints."""
    session = load_session(folder)
    table_of = read_joints(reference, session.fps)
    generic = load_model(DEFAULT_MODEL)
    model = generic.with_height(height_from_joints(generic, table_of))
    return Dancer(name.replace("_", " "), session, model, limb_joints(table_of))


def measure(dancer: Dancer, settings: TrackSettings) -> list[FrameResult]:
    """Track a recording, and compare the poses of each frame."""
    model, start = dancer.model, fit_to_points(dancer.model, dancer.joints[0], centers=True).pose
    session = dancer.session
    with open_observer(session.cameras) as observer:
        frames = range(session.n_frames)
        found = {f.frame: f for f in track_from(observer, [model], [start], frames, settings, session.fps)}
        frames = [k for k in found if k in dancer.joints and k > 0]
        return [_compare(dancer, observer, settings, k, found[k].poses[0]) for k in frames]


def _compare(dancer: Dancer, observer: Observer, settings: TrackSettings, frame: int, tracked: Array) -> FrameResult:
    """Compare the tracked pose of a frame, (n_values,), with the pose refined from the truth."""
    model = dancer.model
    true = fit_to_points(model, dancer.joints[frame], centers=True).pose
    guesses = [(PosedBody(model, pose),) for pose in (true, tracked)]
    views = common_evidence(observer, frame, guesses, settings)
    scorer, sigma = scorer_without_prediction(views, guesses[0], 0, settings), prediction_sigmas(model, settings)
    once = scorer.refined(model, [true], sigma)[0]
    refined = np.array([once, scorer.refined(model, [once], sigma)[0]])
    best = refined[int(scorer.costs_with_priors(model, refined).argmin())]
    step = model.difference(tracked, best)
    between = np.array([model.retract(best, share * step) for share in np.linspace(0.0, 1.0, _ON_LINE)])
    line = scorer.costs_with_priors(model, between)
    cost, tracked_cost = scorer.costs_with_priors(model, np.array([best, tracked])).tolist()
    return FrameResult(
        tracked_cost - cost, cost, float(line.max()) - max(cost, tracked_cost), _error_mm(dancer, frame, tracked),
        _error_mm(dancer, frame, best),
    )  # fmt: skip


def _error_mm(dancer: Dancer, frame: int, pose: Array) -> float:
    """Return the mean error of the limb joints of a pose, (n_values,)."""
    places = joint_centers(dancer.model, pose)
    return 1000 * float(np.mean([np.linalg.norm(places[n] - p) for n, p in dancer.joints[frame].items()]))


def cells(results: Sequence[FrameResult]) -> list[str]:
    """Return the row of a recording, in the order of `HEADS`."""
    excess, cost, barrier, error, from_truth = np.array(results).T
    more = excess > _SAME
    elsewhere = f"{int(np.sum(barrier[more] > _ROUGH))} of {int(more.sum())}"
    return [
        str(len(results)), f"{np.mean(~more):.0%}", f"{np.mean(excess <= 0.01 * np.abs(cost)):.0%}", elsewhere,
        f"{error.mean():.1f}", f"{from_truth.mean():.1f}",
    ]  # fmt: skip


CONDITIONS = Conditions(
    footage="dances of simulated people, and recordings; four cameras with backgrounds",
    body="`gavrila34` of the height that the true joints give",
    start="pose fitted to the true joints of frame 0",
    settings="defaults, first pass alone. The shares are those of frames whose "
    "tracked pose costs at most what the pose refined from the truth does. Of the other frames, those are counted "
    "where a barrier lies between the two poses; on the rest both lie in one valley",
    chosen="those of searches",
    command="python tests/benchmarks/true_pose_costs.py --data DIR --write docs/decisions/by_frame.md",
)


def main() -> None:
    """Measure and write the table."""
    parser = benchmark_parser(__doc__, data="folder with walk and fast_arms", work="folder that keeps the sessions")
    parser.add_argument("--only", nargs="+", help="people and recordings to print; the table stays")
    words = read_words(parser, TABLES)
    with work_folder(words.work) as folder:
        rows = dict[str, list[str]]()
        for dancer in dancers(folder, words.data):
            if words.only and dancer.name.replace(" ", "_") not in words.only:
                continue
            rows[dancer.name] = cells(measure(dancer, TrackSettings()))
            print(f"{dancer.name}: {', '.join(map(' '.join, zip(HEADS, rows[dancer.name], strict=True)))}", flush=True)
    show([] if words.only else words.write, TABLES[0], CONDITIONS, table(HEADS, rows, "recording"))


if __name__ == "__main__":
    main()
