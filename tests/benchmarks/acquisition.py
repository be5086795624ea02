"""Measure what acquired sizes change (docs/measurements.md): `python tests/benchmarks/acquisition.py`.

Ten simulated people of other builds than the model's, children and heavy people among them, are filmed by four cameras
with noise and clutter. Each is tracked with the generic body of the height that the joints of frame 0 give, then
acquired, and tracked again, all by the commands that a user types. `--data DIR` adds the recordings there, `--scenes
DIR` keeps the simulated ones and takes them up again. Accuracy is the mean error of the 12 limb joints; a frame is lost
when one of them is off by more than 150 mm.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from doc_tables import Conditions, parsed, show, table

from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses
from tracker.simulate import Simulation, simulate
from tracker.simulate.people.population import individual

PLAYED = {
    "child_3": ("elbow_rotation", 5),
    "child_6": ("exercise", 5),
    "child_10": ("dance", 7),
    "heavy_child": ("walk_in_place", 10),
    "heavy_man": ("walk_in_place", 5),
    "heavy_woman": ("elbow_rotation", 6),
    "short_woman": ("dance", 5),
    "long_legged_woman": ("reach_and_cross", 8),
    "tall_thin_man": ("leaving", 5),
    "broad_man": ("exercise", 9),
}
"""Scene and seed of each person."""
N_FRAMES = 36
RECORDED = {"walk": (), "balance_real": (), "fast_arms": (), "two_people": ("person1", "person2")}
"""Recordings, and the names of their people if there are several."""
LOST_M = 0.15
TABLES = ("acquisition",)
HEADS = ("height off", "error, mm", "lost frames", "cost, px")
CONDITIONS = Conditions(
    footage=f"{N_FRAMES} frames of each simulated person (a number in a name is an age) with noise and clutter, and "
    "the recordings; four cameras with backgrounds",
    body="`gavrila34` of the height that the joints of frame 0 give → acquired by `quadrille acquire`",
    start="pose fitted to the reference joints of frame 0",
    settings="defaults",
    chosen="those of `acquire`, such as its priors; on the recordings rules of tracking too",
    command="python tests/benchmarks/acquisition.py --data DIR --write docs/measurements.md",
)


@dataclass(frozen=True)
class Recording:
    """Files of a recording with known joints."""

    name: str
    videos: Sequence[Path]
    calibration: Path
    background: Path | None
    references: dict[str, Path]
    """Reference joints of each person."""
    height_m: float | None = None
    """True stature, metres, if known."""

    def label(self, person: str) -> str:
        """Name of a person's row."""
        return self.name if len(self.references) == 1 else f"{self.name}, {person}"

    def height_share(self, height_m: float) -> float | None:
        """Error of a height, as a share; None where the true one is not known."""
        return None if self.height_m is None else height_m / self.height_m - 1


class Row(Protocol):
    """What is measured of one person."""

    @property
    def name(self) -> str:
        """Name of the row."""

    @property
    def cells(self) -> list[str]:
        """Cells of the row."""


RowT = TypeVar("RowT", bound=Row)


class Result(NamedTuple):
    """What a body reaches on a recording."""

    error_mm: float
    lost: int
    cost_px: float


class Outcome(NamedTuple):
    """What an acquisition changes for one person."""

    name: str
    height_share: float | None
    """Error of the height afterwards, as a share; None where it is not known."""
    before: Result
    after: Result

    @property
    def cells(self) -> list[str]:
        """Cells of the table, in the order of `HEADS`."""
        (mm, lost, px), (mm_after, lost_after, px_after) = self.before, self.after
        return [
            percent(self.height_share),
            f"{mm:.1f} → {mm_after:.1f}",
            f"{lost} → {lost_after}",
            f"{px:.2f} → {px_after:.2f}",
        ]


def simulated(folder: Path, names: Sequence[str]) -> Iterator[Recording]:
    """Make the scenes that are not there."""
    for name in names:
        scene, seed = PLAYED[name]
        if not (folder / name).exists():
            simulate(folder / name, Simulation(scene, n_frames=N_FRAMES, seed=seed, person=name))
        at = folder / name
        yield Recording(
            name, sorted(at.glob("*.mp4")), at / "calibration.toml", at / "background", {"person": at / "truth.trc"},
            individual(name).height_m,
        )  # fmt: skip


def recorded(data: Path, names: Sequence[str]) -> Iterator[Recording]:
    """List recordings of a folder."""
    for name in names:
        at, people = data / name, RECORDED[name]
        references = {p: at / f"ground_truth_{p}.trc" for p in people} or {"person": next(at.glob("*.trc"))}
        yield Recording(name, sorted(at.glob("*.mp4")), at / "Calib.toml", at / "background", references)


def measure(recording: Recording, folder: Path) -> list[Outcome]:
    """Track, acquire and track again; return the outcome of each person."""
    session = new_session(recording, folder)
    for person, joints in recording.references.items():
        quadrille("init", session, "--joints", joints, "--person", person)
    before = _tracked(recording, session)
    for person in recording.references:
        quadrille("acquire", session, "--person", person)
    after = _tracked(recording, session)
    out = []
    for person, model in ((p.name, p.model) for p in load_session(session).people):
        share = recording.height_share(model.height_m)
        out.append(Outcome(recording.label(person), share, before[person], after[person]))
    return out


def new_session(recording: Recording, folder: Path) -> Path:
    """Make a session of a recording in a folder."""
    at = folder / recording.name
    background = () if recording.background is None else ("--background", recording.background)
    quadrille(
        "new", at, "--videos", *recording.videos, "--calibration", recording.calibration, *background, "--people",
        *recording.references,
    )  # fmt: skip
    return at


def percent(share: float | None) -> str:
    """Return a share as a cell; empty where it is not known."""
    return "" if share is None else f"{100 * share:+.1f}%"


def _tracked(recording: Recording, session: Path) -> dict[str, Result]:
    """Track all people and evaluate each."""
    quadrille("track", session)
    out = {}
    for person, joints in recording.references.items():
        result = quadrille("evaluate", session, "--reference", joints, "--person", person)
        at = load_session(session)
        model = next(p.model for p in at.people if p.name == person)
        stored = read_stored_poses(at.annotations_path, person, model)
        costs = [s.record.cost_px for s in stored.values() if s.record.cost_px is not None]
        out[person] = Result(result["mpjpe_mm"], result["lost_frames"], float(np.mean(costs)))
    return out


def quadrille(*words: object) -> dict[str, Any]:
    """Run a command and return what it prints as JSON."""
    command = [str(Path(sys.executable).parent / "quadrille"), *map(str, words)]
    done = subprocess.run(command + ([] if words[0] == "new" else ["--json"]), capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}:\n{done.stderr}")
    return {} if words[0] == "new" else json.loads(done.stdout)


def chosen(words: argparse.Namespace, folder: Path) -> list[Recording]:
    """Return the people and recordings that are asked for; scenes that are not kept are made in a folder."""
    scenes = words.scenes or folder / "scenes"
    scenes.mkdir(exist_ok=True)
    wanted = words.only or [*PLAYED, *RECORDED]
    made = simulated(scenes, [n for n in PLAYED if n in wanted])
    return [*made, *(recorded(words.data, [n for n in RECORDED if n in wanted]) if words.data else [])]


def run(
    description: str | None, heads: Sequence[str], measure_one: Callable[[Recording, Path], Iterable[RowT]],
    name: str, conditions: Conditions,
) -> None:  # fmt: skip
    """Read the options, measure the people and recordings that are asked for, and show the table.

    Args:
        description: of the benchmark.
        heads: of the columns.
        measure_one: measures a recording in a folder, and returns a row for each person.
        name: of the table in the document.
        conditions: of the measurement.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--data", type=Path, help="folder with walk, balance_real, fast_arms and two_people")
    parser.add_argument("--scenes", type=Path, help="folder that keeps the simulated recordings")
    parser.add_argument("--only", nargs="+", help="people and recordings to print; the table stays")
    words, rows = parsed(parser, [name]), list[RowT]()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for recording in chosen(words, folder):
            for row in measure_one(recording, folder):
                print(f"{row.name}: {', '.join(map(' '.join, zip(heads, row.cells, strict=True)))}", flush=True)
                rows.append(row)
    cells = {row.name.replace("_", " "): row.cells for row in rows}
    show([] if words.only else words.write, name, conditions, table(heads, cells, "person"))


if __name__ == "__main__":
    run(__doc__, HEADS, measure, TABLES[0], CONDITIONS)
