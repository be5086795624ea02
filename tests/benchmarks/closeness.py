"""What mutual occlusion, joint refinement and the penalty on interpenetration are good for, by how near two people are.

`python tests/benchmarks/closeness.py` writes a table of docs/decisions/by_frame.md. Every variant tracks the same
simulated couples (smooth-skinned people whose bones are not the model's, in a furnished room, with noise) from the
poses fitted to the true joints of frame 0. Accuracy is the mean error of the 12 limb joints of both; a frame of a
person is lost when one of them is off by more than 150 mm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from doc_tables import Conditions, benchmark_parser, measured, read_words, show, table, work_folder
from true_starts import Clip, read_simulated, track_from

from tracker.estimation.chamfer.settings import TrackSettings
from tracker.evaluation.metrics import evaluate_joints, joints_of_poses
from tracker.evidence.observer import open_observer
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.simulate import Simulation, simulate

TABLES = ("closeness",)
DEFAULT = TrackSettings()
UNSEARCHED = replace(DEFAULT, recover=None)
VARIANTS: Mapping[str, TrackSettings] = {
    "as it is": DEFAULT,
    "without mutual occlusion": replace(DEFAULT, occlusion=False),
    "without joint refinement": replace(DEFAULT, rounds=0),
    "without the penalty": replace(DEFAULT, apart=0.0),
    "without all three: each as if alone": replace(DEFAULT, occlusion=False, rounds=0, apart=0.0),
    "without search for lost limbs": UNSEARCHED,
    "nor mutual occlusion": replace(UNSEARCHED, occlusion=False),
    "nor joint refinement": replace(UNSEARCHED, rounds=0),
    "nor the penalty": replace(UNSEARCHED, apart=0.0),
}
DISTANCES = ("apart", "near", "touching", "overlapping")
SEED = 3
STARTS, APART_RAD = {"tango": 5}, 1e-4
"""Scenes that are tracked from several starts, which differ by about so much: in a close hold what is lost depends on
the last digit."""


class Cell(NamedTuple):
    """What a variant reached on a recording."""

    mpjpe_mm: float
    """Mean over everybody."""
    lost_frames: float
    """Summed over everybody."""
    swapped_frames: float
    """Frames on which somebody is nearer to somebody else's reference joints than to the own, summed."""


def measure(couple: Clip, settings: TrackSettings) -> Cell:
    """Track everybody and compare; the mean over all starts."""
    rng, cells = np.random.default_rng(SEED), []
    for i in range(STARTS.get(couple.name, 1)):
        starts = [s + rng.normal(0.0, APART_RAD, s.shape) if i else s for s in couple.starts]
        cells.append(_tracked_from(couple, starts, settings))
    return Cell(*np.mean(cells, axis=0).tolist())


def _tracked_from(couple: Clip, starts: Sequence[Array], settings: TrackSettings) -> Cell:
    """Track everybody from some poses, (n_values,) each, and compare."""
    session, frames = couple.session, couple.frames
    with open_observer(session.cameras) as observer:
        found = track_from(observer, couple.models, starts, frames, settings)
    errors, lost, swapped = [], 0, 0
    for i, model in enumerate(couple.models):
        joints = joints_of_poses(model, {f.frame: f.poses[i] for f in found}, session.fps)
        own = evaluate_joints(joints, couple.references[i], frames)
        errors.append(own.mpjpe_mm)
        lost += own.lost_frames
        swapped += sum(_owner(joints, couple.references, k) != i for k in frames)
    return Cell(float(np.mean(errors)), lost, swapped)


def _owner(joints: MarkerTable, references: Sequence[MarkerTable], frame: int) -> int:
    """Whose reference joints are nearest to some joints on a frame."""
    errors = [evaluate_joints(joints, reference, [frame]).mpjpe_mm for reference in references]
    return int(np.argmin(errors))


def conditions(couples: Sequence[Clip]) -> Conditions:
    """Return the conditions of the measurement."""
    return Conditions(
        footage=f"simulated couples, {len(couples[0].frames)} frames of each, their trunks' middles 1.5, 0.7, 0.45 and "
        "0.25 m apart, and the tango's close hold; four cameras with backgrounds",
        body="`gavrila34` of the true heights",
        start="poses fitted to the true joints of frame 0; of the tango the mean of "
        f"{STARTS['tango']} starts {APART_RAD:g} rad apart, because the last digit decides what is lost there",
        settings="defaults but for what the row says, first pass alone. Each cell: mean "
        "error of the 12 limb joints of both in mm / lost frames of both / frames on which somebody is nearer to the "
        "other's joints",
        chosen="those of people near each other",
        command="python tests/benchmarks/closeness.py --write docs/decisions/by_frame.md",
    )


def main() -> None:
    """Measure and write the section."""
    parser = benchmark_parser(__doc__, scenes="folder to keep the simulated scenes in, and to find them again")
    parser.add_argument("--frames", type=int, default=30, help="frames of each scene")
    words = read_words(parser, TABLES)
    with work_folder(words.scenes) as folder:
        scenes = [*(f"couple_{d}" for d in DISTANCES), "tango"]
        for scene in scenes:
            if not (folder / scene).exists():
                simulate(folder / scene, Simulation(scene, n_frames=words.frames, seed=SEED))
        couples = [read_simulated(folder / scene, words.frames) for scene in scenes]
        rows = measured(VARIANTS, couples, measure, lambda cell: "{:.1f} mm, {:.1f} lost, {:.1f} swapped".format(*cell))
    cells = {
        name: [f"{c.mpjpe_mm:.0f} / {c.lost_frames:.0f} / {c.swapped_frames:.0f}" for c in row]
        for name, row in rows.items()
    }
    heads = [c.name.removeprefix("couple_") for c in couples]
    show(words.write, TABLES[0], conditions(couples), table(heads, cells))


if __name__ == "__main__":
    main()
