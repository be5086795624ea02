"""Measure what to expect on footage that no setting was chosen on: `python tests/benchmarks/unseen_people.py`.

It films simulated people in motions and rooms that no other benchmark has, by a seed that none of them uses. Two of the
three kinds of rooms are met nowhere else. Each body is acquired from the joints of frame 0. Then all are tracked
by the first pass alone and by the whole run, as by `joint_errors.py`. After a change that was made because of these
figures, they no longer serve: raise `SEED` and measure again. `--work DIR` keeps scenes and sessions.
"""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from acquisition import Recording, new_session, quadrille, set_first_poses
from doc_tables import Conditions, benchmark_parser, read_words, show, table, work_folder
from joint_errors import HEADS, Compared, groups, measured, pooled

from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate
from tracker.simulate.stage.furniture import ROOMS

TABLES = ("unseen_people", "unseen_people sparse", "unseen_people few")
SEED = 7321
"""Of rooms, motions and noise. Not used anywhere else."""
N_FRAMES = 36
SPARSE_FPS = 8.0
"""Frame rate at which an arm in a dance moves by 30 cm from one picture to the next, 1/s."""

SLOWEST_FPS = 5.0
"""Frame rate of the slowest recordings, 1/s."""


class Scene(NamedTuple):
    """A recording that no other benchmark has."""

    motion: str
    """One of `scenes.SCENES`."""
    person: str = ""
    """One of `population.POPULATION`; the usual adults of the scene if empty."""
    room: str = "laboratory"
    """One of `furniture.ROOMS`."""
    fps: float = 25.0
    """Frame rate, 1/s."""

    @property
    def name(self) -> str:
        """Name of the folder, and of the row."""
        sparse = f"at_{self.fps:.0f}_fps" if self.fps < 15 else ""
        return "_".join(word for word in (self.person, self.motion, "in", self.room, sparse) if word)

    @property
    def is_alone(self) -> bool:
        """Whether there is a single person."""
        return "couple" not in self.motion


SCENES = (
    Scene("exercise", "child_10"),
    Scene("dance", "short_woman"),
    Scene("reach_and_cross", "heavy_man", fps=15.0),
    Scene("leaving"),
    Scene("dance", "heavy_woman", "studio"),
    Scene("exercise", "long_legged_woman", "studio"),
    Scene("reach_and_cross", "child_6", "studio"),
    Scene("dance", "tall_thin_man", "studio", fps=15.0),
    Scene("exercise", "broad_man", "theater"),
    Scene("dance", "heavy_child", "theater"),
    Scene("reach_and_cross", "child_3", "theater"),
    Scene("dance", room="theater", fps=15.0),
    Scene("couple_near"),
    Scene("couple_near", room="theater"),
)
"""Twelve people by themselves, of all builds, and two couples."""
SPARSE = tuple(scene._replace(fps=SPARSE_FPS) for scene in SCENES)
"""The same people in other motions, of which so few pictures are taken that limbs are lost."""
SLOWEST = tuple(scene._replace(fps=SLOWEST_FPS) for scene in SCENES)
FEW = ((SLOWEST, 4), (SCENES, 3), (SPARSE, 3), (SLOWEST, 3))
"""The same scenes at fewer frames a second and with fewer cameras, and how many."""
CONDITIONS = Conditions(
    footage=f"simulated people with noise, {N_FRAMES} frames each at 25 or 15 frames/s, four cameras with backgrounds; "
    f"seed {SEED}. The laboratory is full of things, as in the other benchmarks; the studio is empty and gray, the "
    "theater dark. Builds and kinds of motion are those of the other benchmarks; rooms, noise and motions are new",
    body=f"`{DEFAULT_MODEL}`, acquired from the joints of frame 0 by `quadrille acquire`",
    start="pose fitted to the true joints of frame 0",
    settings="defaults, first pass → whole run",
    chosen="none",
    command="python tests/benchmarks/unseen_people.py --write docs/log/accuracy.md",
)
SPARSE_CONDITIONS = CONDITIONS._replace(
    footage=CONDITIONS.footage.replace("25 or 15 frames/s", f"{SPARSE_FPS:.0f} frames/s")
)
FEW_CONDITIONS = CONDITIONS._replace(
    footage=CONDITIONS.footage.replace(" at 25 or 15 frames/s, four cameras", ", rates and cameras as stated,")
)


def acquired(scene: Scene, folder: Path) -> tuple[Path, list[Path]]:
    """Film a scene and acquire its people, unless that is done already; return the session and its references."""
    scenes, sessions = folder / "scenes", folder / "sessions"
    filmed, at = scenes / scene.name, sessions / scene.name
    sessions.mkdir(parents=True, exist_ok=True)
    if not filmed.exists():
        simulate(
            filmed, Simulation(scene.motion, 4, N_FRAMES, SEED, fps=scene.fps, person=scene.person, room=scene.room)
        )
    people = [p.name for p in load_session(filmed).people]
    references = [filmed / ("truth.trc" if len(people) == 1 else f"truth_{name}.trc") for name in people]
    if not at.exists():
        recording = Recording(
            scene.name, sorted(filmed.glob("*.mp4")), filmed / "calibration.toml", filmed / "background",
            dict(zip(people, references, strict=True)),
        )  # fmt: skip
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            made = new_session(recording, Path(scratch))
            set_first_poses(recording, made)
            for name in people:
                quadrille("acquire", made, "--person", name)
            made.rename(at)
    return at, references


def rows_of(scenes: Sequence[Scene], folder: Path) -> dict[str, list[str]]:
    """Measure scenes; return the rows of a table, sums first."""
    found: list[Compared] = []
    for scene in scenes:
        for compared in measured(*acquired(scene, folder)):
            found.append(compared)
            print(f"{compared.name}: {' | '.join(compared.cells)}", flush=True)
    names: dict[str, list[str]] = {"**one person**": [], **{f"**one person, {room}**": [] for room in ROOMS}}
    names["**two people**"] = []
    for scene in scenes:
        of = ("**one person**", f"**one person, {scene.room}**") if scene.is_alone else ("**two people**",)
        for title in of:
            names[title].append(scene.name.replace("_", " "))
    return groups(found, names) | {c.name: c.cells for c in found}


def rows_of_few(folder: Path) -> dict[str, list[str]]:
    """Measure all scenes with fewer pictures; return sums, those of all first."""
    rows, everything = dict[str, list[str]](), list[Compared]()
    for scenes, n_cameras in FEW:
        fps = "25 or 15" if scenes is SCENES else f"{scenes[0].fps:.0f}"
        for kind, some in (("one person", [s for s in scenes if s.is_alone]), ("two people", scenes[-2:])):
            found = [c for s in some for c in measured(*acquired(s, folder), n_cameras)]
            everything += found
            title = f"{n_cameras} cameras, {fps} frames/s, {kind}"
            rows[title] = pooled(title, found).cells
            print(f"{title}: {' | '.join(rows[title])}", flush=True)
    return {"**all**": pooled("all", everything).cells} | rows


def main() -> None:
    """Measure all scenes, and write the table."""
    parser = benchmark_parser(__doc__, work="folder that keeps scenes and sessions")
    names = [s.name for s in (*SCENES, *SPARSE)]
    parser.add_argument("--only", nargs="+", choices=names, help="scenes to print, not to write")
    given = read_words(parser, TABLES)
    for title, scenes, conditions in zip(TABLES[:2], (SCENES, SPARSE), (CONDITIONS, SPARSE_CONDITIONS), strict=True):
        chosen = [s for s in scenes if s.name in (given.only or names)]
        with work_folder(given.work) as folder:
            rows = rows_of(chosen, folder)
        show([] if given.only else given.write, title, conditions, table(HEADS, rows, "people"))
    if not given.only:
        with work_folder(given.work) as folder:
            rows = rows_of_few(folder)
        show(given.write, TABLES[2], FEW_CONDITIONS, table(HEADS, rows, "people"))


if __name__ == "__main__":
    main()
