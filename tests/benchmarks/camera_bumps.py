"""Measure which camera the check names (docs/log/calibration.md): `python tests/benchmarks/camera_bumps.py --data DIR`.

One camera of a calibration is made wrong at random, so that the people's joints shift by a known amount in its
picture. The recording is tracked under the wrong calibration, and `check_calibration` judges it. Recordings under their
right calibration show false alarms, with acquired bodies and with those of height alone. Simulated people have seeds
that no other benchmark has. `--work DIR` keeps scenes, sessions and results, so that an interrupted run goes on.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from acquisition import N_FRAMES, Recording, new_session, quadrille, recorded, set_first_poses
from calibration_repair import off
from doc_tables import Conditions, benchmark_parser, read_words, show, table, work_folder
from known_faults import fit_fault

from tracker.calibration.check.fault_search import Fault
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording as OpenRecording
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp, so3_log
from tracker.pipeline.calibration_check import check_calibration
from tracker.pipeline.posed_recording import N_FRAMES as N_CHECKED
from tracker.pipeline.posed_recording import PosedRecording
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate

TABLES = ("camera_bumps named", "camera_bumps rotations")
SHIFTS_PX = (1.5, 12.0)
"""Least and largest root mean square shift of the joints in the picture of the bumped camera."""
UNITS = {
    "rotation": (1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0),
    "focal": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    "mix": (0.5, 0.5, 0.5, 3.0, 3.0, 3.0, 1.0),
}
"""By kind, standard deviations that a bump has before it is scaled, in the units of `calibration_repair.BUMPS`."""
KIND_WORDS = {"rotation": "turned", "position": "moved", "focal": "zoomed", "mix": "all three"}
TURNS = ("rotation", "mix", "position", "rotation", "focal", "rotation", "position", "mix")
"""Kinds of the bumps of each recording, in turn."""
SEED = 7300
"""Of the bumps, and the first one of the simulated people. Not used anywhere else."""
FILMED = ("walk", "fast_arms", "two_people")
SIMULATED = (("exercise", "tall_thin_man"), ("dance", "heavy_woman"), ("reach_and_cross", "child_10"),
             ("dance", "broad_man"), ("exercise", "short_woman"))  # fmt: skip
"""Scene and person."""
FPS = 15.0
GENERIC = ("broad_man",)
"""People whose bumped recordings are tracked with a body of height alone."""
BODIES = ("acquired", "generic")
COMMAND = "python tests/benchmarks/camera_bumps.py --data DIR --write docs/log/calibration.md"


class Bump(NamedTuple):
    """A camera of a recording that is off."""

    camera: int
    kind: str
    """One of `UNITS`."""
    values: tuple[float, ...]
    """In the units of `calibration_repair.BUMPS`."""
    shift_px: float


class Judged(NamedTuple):
    """Result of a check."""

    recording: str
    body: str
    """One of `BODIES`."""
    kind: str
    """One of `UNITS`; empty for a right calibration."""
    camera: str
    """Name of the bumped camera."""
    shift_px: float
    named: list[str]
    said: str
    """Kinds by which the bumped camera was named."""
    error_deg: list[float]
    """Pitch, yaw and roll of the camera after the correction against the true one, with camera and kind given; of
    bumps that are rotations alone."""
    sigma_deg: list[float]
    """Their standard deviations."""


def recordings(data: Path, folder: Path, wanted: Sequence[str]) -> Iterator[tuple[int, Recording]]:
    """List recordings with their indices; simulated ones are made."""
    yield from ((i, r) for i, r in enumerate(recorded(data, FILMED)) if r.name in wanted)
    for i, (scene, person) in enumerate(SIMULATED):
        if person not in wanted:
            continue
        at = folder / "scenes" / person
        if not at.exists():
            simulate(at, Simulation(scene, n_frames=N_FRAMES, seed=SEED + i, person=person, fps=FPS))
        truth = {"person": at / "truth.trc"}
        videos = sorted(at.glob("*.mp4"))
        yield len(FILMED) + i, Recording(person, videos, at / "calibration.toml", at / "background", truth)


def bumped(cameras: Sequence[Camera], joints: Array, index: int, number: int, folder: Path) -> Bump:
    """Draw a bump of a camera.

    Args:
        cameras: with their right calibration.
        joints: true ones of everybody, (..., 3).
        index: of the recording.
        number: of the bump in the recording.
        folder: for a file.
    """
    random, kind, i = np.random.default_rng([SEED, index, number]), TURNS[number], (index + number) % len(cameras)
    direction = random.normal(size=N_CORRECTIONS - 2) * UNITS[kind]
    wanted_px = float(np.exp(random.uniform(*np.log(SHIFTS_PX))))

    def shift_px(values: Array) -> float:
        wrong = off(cameras[i].name, values.tolist(), folder / "right.toml", folder / "tried.toml")
        moved = read_calibration(wrong)[i].project(joints) - cameras[i].project(joints)
        return float(np.sqrt(np.nanmean(np.sum(moved**2, axis=-1))))

    for _ in range(6):  # A shift is almost proportional to the bump.
        direction *= wanted_px / shift_px(direction)
    return Bump(i, kind, tuple(float(v) for v in direction), shift_px(direction))


def started(recording: Recording, folder: Path, bodies: Mapping[str, Path]) -> Path:
    """Make a session with the poses of frame 0."""
    at = new_session(recording, folder, bodies)
    set_first_poses(recording, at)
    return at


def bodies_of(recording: Recording, folder: Path) -> dict[str, Path]:
    """Acquire the bodies of a recording under its right calibration, unless that is done."""
    at = folder / "bodies"
    if not at.exists():
        made = started(recording, folder / "bodies in the making", {})
        for person in recording.references:
            quadrille("acquire", made, "--person", person, "--frames", f"0:{N_FRAMES}")
        made.rename(at)
    return {person: at / "models" / f"{person}.toml" for person in recording.references}


def judged(at: Path, recording: str, body: str, bump: Bump | None, right: Sequence[Camera]) -> Judged:
    """Check the cameras of a tracked session."""
    session = load_session(at)
    with OpenRecording(session.cameras) as footage:
        posed = PosedRecording.of_session(session, Observer(session.cameras, footage))
        check = check_calibration(posed)
        error, sigma = (np.zeros(0), np.zeros(0))
        if bump is not None and bump.kind == "rotation":
            seen = posed.seen(posed.diverse(posed.credible_frames(), N_CHECKED))
            parameters = [SizeParameters(b.model) for b in seen[0].bodies]
            fitted = fit_fault(seen, parameters, posed.fps, Fault(bump.camera, "rotation"))
            correction = fitted.corrections[bump.camera][ROTATION]
            mended = so3_exp(correction) @ _rotation(session.cameras[bump.camera].camera)
            error = np.degrees(so3_log(mended @ _rotation(right[bump.camera]).T))
            sigma = np.degrees(fitted.sigmas(bump.camera)[ROTATION])
    by = "+".join(check.cameras[bump.camera].kinds) if bump else ""
    return Judged(
        recording, body, bump.kind if bump else "", right[bump.camera].name if bump else "",
        bump.shift_px if bump else 0.0, [*check.named], by, error.tolist(), sigma.tolist(),
    )  # fmt: skip


def _rotation(camera: Camera) -> Array:
    return camera.T_camera_world[:3, :3]


def measured(recording: Recording, index: int, numbers: Sequence[int], folder: Path) -> Iterator[Judged]:
    """Check a recording under its right calibration and with each bump; results that are kept are read.

    Args:
        recording: footage with known joints.
        index: of the recording.
        numbers: of the bumps.
        folder: for sessions and results.
    """
    folder.mkdir(parents=True, exist_ok=True)
    acquired = bodies_of(recording, folder)
    right = read_calibration(folder / "bodies" / "calibration.toml")
    write_calibration(folder / "right.toml", right)
    tables = [read_joints(path, load_session(folder / "bodies").fps) for path in recording.references.values()]
    joints = np.concatenate([t.points[t.frames < N_FRAMES].reshape(-1, 3) for t in tables])
    for body in BODIES:
        bodies = acquired if body == "acquired" else {}
        yield _kept(folder, f"right, {body}", folder / "right.toml", (recording, body, bodies, None, right))
    body = BODIES[recording.name in GENERIC]
    bodies = acquired if body == "acquired" else {}
    for number in numbers:
        bump = bumped(right, joints, index, number, folder)
        wrong = off(right[bump.camera].name, bump.values, folder / "right.toml", folder / f"{number}.toml")
        yield _kept(folder, f"bump {number}", wrong, (recording, body, bodies, bump, right))


def _kept(
    folder: Path, name: str, calibration: Path,
    trial: tuple[Recording, str, Mapping[str, Path], Bump | None, Sequence[Camera]],
) -> Judged:  # fmt: skip
    result = folder / f"{name}.json"
    if not result.exists():
        recording, body, bodies, bump, right = trial
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            at = started(replace(recording, calibration=calibration), Path(scratch), bodies)
            quadrille("track", at, "--no-whole-run", "--frames", f"0:{N_FRAMES}")
            judgement = judged(at, recording.name, body, bump, right)
        result.write_text(json.dumps(judgement._asdict()), "utf-8")
    return Judged(**json.loads(result.read_text("utf-8")))


def conditions(found: Sequence[Judged]) -> Conditions:
    """Return the conditions of the recordings that were measured."""
    names = list(dict.fromkeys(j.recording for j in found))
    films = [f"`{name}`" for name in names if name in FILMED]
    others = len(names) - len(films)
    people = [f"{others} simulated people at {FPS:g} frames/s, of seeds from {SEED} on"] if others else []
    return Conditions(
        f"the first {N_FRAMES} frames of {', '.join([*films, *people])}; four cameras. One of them is bumped so that "
        f"the joints shift by {SHIFTS_PX[0]:g} to {SHIFTS_PX[1]:g} px in its picture",
        "acquired under the right calibration, or with sizes by height alone, as the rows say",
        "the reference joints of frame 0",
        "defaults; tracked under the wrong calibration with `--no-whole-run`",
        "the rules of the check, on other bumps of the three recordings; none on these",
        COMMAND,
    )


def named_cells(found: Sequence[Judged]) -> list[str]:
    """Count bumps by whether the right camera is named."""
    if not found:
        return ["0", "", "", ""]
    right = [j.camera in j.named for j in found]
    first = [j.named[:1] == [j.camera] for j in found]
    others = [bool(set(j.named) - {j.camera}) for j in found]
    return [
        str(len(found)),
        f"{sum(right)} ({np.mean(right):.0%})",
        str(sum(first)),
        f"{sum(others)} ({np.mean(others):.0%})",
    ]


def rotation_cells(found: Sequence[Judged]) -> list[str]:
    """Return errors of rotations, by axis and by their standard deviations."""
    if not found:
        return ["0", "", "", "", "", ""]
    errors, sigmas = np.array([j.error_deg for j in found]), np.array([j.sigma_deg for j in found])
    rms, ratio = np.sqrt(np.mean(errors**2, axis=0)), np.sqrt(np.mean((errors / sigmas) ** 2, axis=0))
    together = np.sqrt(np.mean((errors / sigmas) ** 2))
    return [str(len(found)), *(f"{v:.3f}" for v in rms), ", ".join(f"{v:.1f}" for v in ratio), f"{together:.1f}"]


def main() -> None:
    """Measure and print, or write the tables."""
    data, work = "folder with walk, fast_arms and two_people", "folder that keeps scenes, sessions and results"
    parser = benchmark_parser(__doc__, ["data"], data=data, work=work)
    parser.add_argument("--kept", action="store_true", help="show what --work keeps of an interrupted run, and end")
    parser.add_argument("--only", nargs="+", help="recordings to print, not to write")
    parser.add_argument("--bumps", type=int, default=len(TURNS), help="bumps of each recording, to print")
    words = read_words(parser, TABLES)
    if words.kept:
        names = [*FILMED, *(person for _, person in SIMULATED)]
        kept = [path for name in names for path in sorted((words.work / name).glob("*.json"))]
        _show([Judged(**json.loads(path.read_text("utf-8"))) for path in kept], words.write)
        return
    found = list[Judged]()
    with work_folder(words.work) as folder:
        for index, recording in recordings(words.data, folder, words.only or [*FILMED, *(p for _, p in SIMULATED)]):
            for one in measured(recording, index, range(words.bumps), folder / recording.name):
                found.append(one)
                print(*one, flush=True)
    write = [] if words.only or words.bumps < len(TURNS) else words.write
    _show(found, write)


def _show(found: Sequence[Judged], write: Sequence[Path]) -> None:
    bumps, healthy = [j for j in found if j.kind], [j for j in found if not j.kind]
    groups: dict[str, Callable[[Judged], bool]] = {"**all bumps**": lambda j: True}
    groups |= {KIND_WORDS[kind]: lambda j, kind=kind: j.kind == kind for kind in UNITS}
    low, middle, high = SHIFTS_PX[0], float(np.sqrt(np.prod(SHIFTS_PX))), SHIFTS_PX[1]
    groups |= {
        f"{a:.1f} to {b:.1f} px": lambda j, a=a, b=b: a <= j.shift_px < b
        for a, b in ((low - 0.1, middle), (middle, high + 0.1))
    }
    groups |= {f"{body} bodies": lambda j, body=body: j.body == body for body in BODIES}
    rows = {title: named_cells([j for j in bumps if has(j)]) for title, has in groups.items()}
    for body in BODIES:
        own = [j for j in healthy if j.body == body]
        rows[f"right calibrations, {body} bodies"] = [str(len(own)), "", "", f"{sum(bool(j.named) for j in own)}"]
    heads = ("number", "right camera named", "named first", "another camera named")
    show(write, TABLES[0], conditions(found), table(heads, rows, "bumps"))
    turned = [j for j in bumps if j.kind == "rotation"]
    rows = {
        "all": rotation_cells(turned),
        **{f"{body} bodies": rotation_cells([j for j in turned if j.body == body]) for body in BODIES},
        "camera named, by a turn alone": rotation_cells([j for j in turned if j.said == "rotation"]),
    }
    heads = (
        "bumps", "pitch, degrees rms", "yaw", "roll", "errors over standard deviations, rms: pitch, yaw, roll",
        "together",
    )  # fmt: skip
    show(write, TABLES[1], conditions(found), table(heads, rows, "turned cameras"), is_repeated=True)


if __name__ == "__main__":
    main()
