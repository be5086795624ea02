"""Measure how people are found: `python tests/benchmarks/find_people.py --scenes DIR --data DIR`.

It films people in motions and rooms of new seeds by four to eight cameras, and takes the recordings of `--data`. In
some rooms things were moved since one camera saw it empty, and others see little contrast. Bodies are presets. Each row
has what `init --method auto` found, its error against the true joints and the processor time of the whole command. With
`--models FOLDER` people are detected first, and backgrounds are left out. `--only` takes parts of names.
"""

import argparse
import resource
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from acquisition import RECORDED, Recording, new_session, quadrille, recorded

from tracker.body.model import PosedBody
from tracker.evaluation.references import read_joints
from tracker.footage.video import open_footage
from tracker.footage.video_writer import VideoWriter
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Image
from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses
from tracker.simulate import Simulation, simulate

CONTRAST, NOISE = 0.6, 3.0
"""What is left of the differences of a picture without contrast, and its noise, gray values."""


class Scene(NamedTuple):
    """A recording that no other benchmark has."""

    motion: str
    n_cameras: int
    seed: int
    person: str = ""
    fps: float = 25.0
    n_frames: int = 42
    size: tuple[int, int] = (960, 540)
    room: str = "laboratory"
    broken: tuple[int, ...] = ()
    """Views in which things were moved since the room was empty."""
    flat: tuple[int, ...] = ()
    """Views of little contrast."""

    @property
    def name(self) -> str:
        """Name of the folder, and of the row."""
        faults = f"_{len(self.broken)}_broken_{len(self.flat)}_flat" if self.broken or self.flat else ""
        who = self.person or "adult" * ("couple" not in self.motion)
        return f"{self.motion}_{who}_{self.n_cameras}x{self.size[0]}_{self.fps:.0f}_s{self.seed}{faults}"


SCENES = (
    Scene("exercise", 6, 3102, "heavy_woman"),
    Scene("exercise", 6, 3102, "heavy_woman", broken=(4,), flat=(1, 2)),
    Scene("couple_apart", 6, 3110),
    Scene("couple_apart", 6, 3110, broken=(3,), flat=(0, 4)),
    Scene("walk_in_place", 6, 3101, n_frames=90, broken=(2,), flat=(0, 3)),
    Scene("dance", 5, 3106, "short_woman", 60.0, broken=(0,), flat=(3,)),
    Scene("dance", 8, 3105, "child_10", broken=(5,), flat=(2, 6)),
    Scene("reach_and_cross", 4, 3107, "broad_man", size=(1024, 576), broken=(2,)),
    Scene("reach_and_cross", 6, 3104, "tall_thin_man", 60.0),
)


def filmed(scene: Scene, folder: Path) -> Recording:
    """Film a scene unless that is done; return the recording."""
    at, whole = folder / scene.name, scene._replace(broken=(), flat=())
    options = (scene.n_cameras, scene.n_frames, scene.seed, scene.size, scene.fps)
    if not at.exists() and scene == whole:
        simulate(at, Simulation(scene.motion, *options, person=scene.person, room=scene.room))
    elif not at.exists():
        filmed(whole, folder)
        made = folder / f".{scene.name}"
        shutil.copytree(folder / whole.name, made, dirs_exist_ok=True)
        for view, source in enumerate(load_session(made).cameras):
            rng = np.random.default_rng([scene.seed, view])
            assert source.background is not None
            empty = cv2.imread(str(source.background))
            if view in scene.broken:  # someone has moved a strip of the room
                empty = np.where(
                    np.arange(empty.shape[1])[None, :, None] % 480 < 160, np.roll(empty, 40, axis=1), empty
                )
            if view in scene.flat:
                empty = _flat(empty, rng)
                _flatten(source.footage, scene, rng)
            cv2.imwrite(str(source.background), empty)
        made.rename(at)
    names = [p.name for p in load_session(at).people]
    files = ["truth.trc"] if len(names) == 1 else [f"truth_{name}.trc" for name in names]
    references = {name: at / file for name, file in zip(names, files, strict=True)}
    return Recording(scene.name, sorted(at.glob("*.mp4")), at / "calibration.toml", at / "background", references)


def _flatten(path: Path, scene: Scene, rng: np.random.Generator) -> None:
    footage, flat = open_footage(path, path.stem), path.with_suffix(".flat.mp4")
    with VideoWriter(flat, scene.size, scene.fps) as video:
        for k in range(scene.n_frames):
            video.write(_flat(footage.read(k), rng))
    footage.close()
    flat.replace(path)


def _flat(image: Image, rng: np.random.Generator) -> Image:
    noise = rng.normal(0.0, NOISE, image.shape)
    return np.clip(128 + CONTRAST * (image.astype(float) - 128) + noise, 0, 255).astype(np.uint8)


def measured(recording: Recording, folder: Path, models: Path | None) -> Iterator[str]:
    """Find the people of a recording; yield a line on each."""
    if models is not None:
        recording = replace(recording, background=None)
    at = new_session(recording, folder)
    detected = 0.0 if models is None else _spent(lambda: quadrille("detect", at, "--as", "net", "--models", models))
    found = {}
    try:
        spent = _spent(lambda: found.update(quadrille("init", at, "--method", "auto")))
    except SystemExit as error:
        yield f"{recording.name}: not found: {error}"
        return
    session = load_session(at)
    tables = [read_joints(path, session.fps) for path in recording.references.values()]
    for own, person in zip(found["people"], session.people, strict=True):
        frames = range(session.n_frames)
        body = read_stored_poses(session.annotations_path, person.name, person.model, frames)[found["frame"]].body
        mean_mm, worst_mm = min(_error_mm(body, table, found["frame"]) for table in tables)
        yield (
            f"{recording.label(person.name)}: {detected:.1f} s + {spent:.1f} s, {own['status']} by {own['method']} on "
            f"{found['frame']}, {mean_mm:.0f} mm, worst {worst_mm:.0f}, {own['height_m']:.2f} m. "
            f"{'; '.join(own['notes'])}"
        )


def _spent(work: Callable[[], object]) -> float:
    """Return the processor time of commands, s."""
    began = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        work()
    finally:
        ended = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
        print(f"{spent:.1f} s of processor time", flush=True)
    return spent


def _error_mm(body: PosedBody, table: MarkerTable, frame: int) -> tuple[float, float]:
    own = dict(zip(body.model.point_names, body.joint_centers_world, strict=True))
    points = dict(zip(table.names, table.points[int(np.flatnonzero(table.frames == frame)[0])], strict=True))
    off = [1000 * float(np.linalg.norm(own[n] - points[n])) for n in LIMB_JOINTS]
    return float(np.mean(off)), max(off)


def main() -> None:
    """Measure all scenes and recordings that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=Path, help="folder that keeps the simulated recordings")
    parser.add_argument("--data", type=Path, help="folder with walk, balance_real, fast_arms and two_people")
    parser.add_argument("--models", type=Path, help="folder with the networks of a detector")
    parser.add_argument("--only", nargs="+", default=[""], help="parts of names")
    given = parser.parse_args()

    def is_wanted(name: str) -> bool:
        return any(part in name for part in given.only)

    with tempfile.TemporaryDirectory() as scratch:
        if given.data:
            for recording in recorded(given.data, [n for n in RECORDED if is_wanted(n)]):
                for line in measured(recording, Path(scratch), given.models):
                    print(line, flush=True)
        for scene in (s for s in SCENES if given.scenes and is_wanted(s.name)):
            for line in measured(filmed(scene, given.scenes), Path(scratch), given.models):
                print(line, flush=True)


if __name__ == "__main__":
    main()
