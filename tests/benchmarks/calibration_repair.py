"""Measure what the check of cameras repairs (docs/log/calibration.md): `calibration_repair.py --data DIR`.

Calibrations are made wrong by known amounts, and recordings are tracked under them. Then `quadrille check --apply` and
`quadrille track` take turns until nothing is named any more. Shifts in time are those of the pictures: a camera has
other frames of footage with a multiple of the rate than the others have. Simulated footage is rendered at 120 frames a
second; `walk` and `balance_real` are thinned. `--only` measures some of the tables.
"""

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from acquisition import PLAYED, quadrille
from doc_tables import Conditions, benchmark_parser, read_words, show, table

from tracker.evidence.observer import open_observer
from tracker.footage.video import open_footage
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.formats.trc import MarkerTable, read_trc, write_trc
from tracker.geometry.arrays import Array, Image
from tracker.geometry.camera_correction import N_CORRECTIONS, corrected
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp
from tracker.pipeline.calibration_check import check_calibration, held_out_scores, n_better
from tracker.pipeline.posed_recording import PosedRecording
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate

TABLES = (
    "calibration_repair bumps", "calibration_repair time", "calibration_repair drift", "calibration_repair lost",
    "calibration_repair change", "calibration_repair body",
)  # fmt: skip
MAX_ROUNDS = 4
BUMPS = {
    "yaw 0.2°": (0, 0.2, 0, 0, 0, 0, 0),
    "yaw 0.5°": (0, 0.5, 0, 0, 0, 0, 0),
    "yaw 1°": (0, 1, 0, 0, 0, 0, 0),
    "pitch 0.5°": (0.5, 0, 0, 0, 0, 0, 0),
    "roll 1°": (0, 0, 1, 0, 0, 0, 0),
    "2 cm to the right": (0, 0, 0, 2, 0, 0, 0),
    "5 cm down": (0, 0, 0, 0, 5, 0, 0),
    "zoom 2%": (0, 0, 0, 0, 0, 0, 2),
    "yaw -0.6°, pitch 0.4°, 2 cm twice, zoom 1%": (0.4, -0.6, 0, 2, 0, 2, 1),
}
"""Of a camera of the calibration: degrees about its right, down and forward axes, cm along them, focal length in %."""
FROM_NOTHING = "yaw 1°"
DENSE_FPS = 120.0
N_FRAMES = 40
SIMULATED = ("child_10", "broad_man")
SHIFTS = (0.5, 1.0, 2.0)
"""Frames by which the pictures of one camera are late."""
DRIFT = 0.02
"""Frames a frame."""
DRIFTING = {"broad_man": ("exercise", 4101), "heavy_man": ("walk_in_place", 4102)}
"""Scene and seed of people of whom one camera drifts."""
N_DRIFTING = 120
"""Frames of them at 30 frames a second: an offset is known within 2 ms, and 4 s of a drift are 80 ms."""
CHANGES = (("walk", 0, 30, (0.0, 0.8, 0.0)), ("walk", 2, 20, (0.6, 0.0, 0.0)), ("fast_arms", 1, 25, (0.0, -0.7, 0.3)))
"""Recording, index of the camera, the frame from which on it is turned, and by which angles, degrees."""

LOST = (("walk", 2, 30, 1), ("walk", 0, 25, 2), ("fast_arms", 1, 25, 1), ("fast_arms", 3, 30, 2))
"""Recording, index of the camera, the frame before which it loses frames, and their number."""


@dataclass(frozen=True)
class Footage:
    """Images of all cameras, with known joints."""

    name: str
    folders: Mapping[str, Path]
    """Images by camera, `%06d.png`."""
    calibration: Path
    background: Path
    joints: MarkerTable
    """A row for each image."""
    fps: float

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras."""
        return [*self.folders]

    @property
    def n_images(self) -> int:
        """Number of images of each camera."""
        return min(len(list(f.iterdir())) for f in self.folders.values())


class Measured(NamedTuple):
    """Cells of a table."""

    first: str
    heads: Sequence[str]
    rows: Mapping[str, Sequence[str]]
    conditions: Conditions


def conditions(footage: str, body: str, start: str) -> Conditions:
    """Return the conditions of a table."""
    chosen = "the rules of the check, as said above"
    command = "python tests/benchmarks/calibration_repair.py --data DIR --write docs/log/calibration.md"
    return Conditions(footage, body, start, "defaults; tracking with `--no-whole-run`", chosen, command)


def decoded(name: str, at: Path, folder: Path) -> Footage:
    """Write the images of a recording into a folder."""
    files = {p.stem: p for p in sorted(at.glob("*.mp4"))}
    folders, fps = {}, 0.0
    for camera, path in files.items():
        footage = open_footage(path, camera)
        fps, folders[camera] = footage.fps, folder / f"{name} images" / camera
        folders[camera].mkdir(parents=True)
        for k in range(footage.n_frames):
            image = footage.read(k)
            assert image is not None
            cv2.imwrite(str(folders[camera] / f"{k:06d}.png"), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 0])
        footage.close()
    calibration = next(p for p in (at / "Calib.toml", at / "calibration.toml") if p.exists())
    return Footage(name, folders, calibration, at / "background", read_trc(next(at.glob("*.trc"))), fps)


def rendered(person: str, folder: Path, played: tuple[str, int] | None = None, n_frames: int = N_FRAMES) -> Footage:
    """Render a simulated person, who plays a scene by a seed, at a multiple of the usual rate."""
    (scene, seed), at = played or PLAYED[person], folder / f"{person} scene"
    n = int(DENSE_FPS / 30 * (n_frames + 2 * max(SHIFTS)))
    simulate(at, Simulation(scene, n_frames=n, seed=seed, person=person, fps=DENSE_FPS))
    return decoded(person, at, folder)


def thinned(
    dense: Footage, folder: Path, every: int = 1, late: Callable[[str, int], float] = lambda camera, k: 0.0
) -> Footage:
    """Take each n-th image.

    Args:
        dense: all images.
        folder: for the images that are taken.
        every: n.
        late: number of frames by which a frame of a camera is late; rounded to whole images.
    """
    longest = max(late(c, k) for c in dense.cameras for k in range(dense.n_images // every))
    n = int((dense.n_images - 1) / every - max(0.0, longest)) + 1
    for camera, images in dense.folders.items():
        (folder / camera).mkdir(parents=True)
        for k in range(n):
            image = images / f"{round(every * (k + late(camera, k))):06d}.png"
            (folder / camera / f"{k:06d}.png").hardlink_to(image)
    points = dense.joints.points[: every * n : every]
    joints = replace(dense.joints, frames=np.arange(n), times=every * np.arange(n) / dense.fps, points=points)
    folders = {c: folder / c for c in dense.cameras}
    return replace(dense, folders=folders, joints=joints, fps=dense.fps / every)


def started(footage: Footage, at: Path, body: Path | None = None, calibration: Path | None = None) -> Path:
    """Make a session with a pose on its first frame."""
    words = ["--model", body] if body is not None else []
    quadrille(
        "new", at, "--videos", *footage.folders.values(), "--calibration", calibration or footage.calibration,
        "--background", footage.background, "--fps", footage.fps, *words,
    )  # fmt: skip
    joints = _joints(at)
    write_trc(joints, footage.joints.names, footage.joints.points, footage.fps)
    quadrille("init", at, "--joints", joints, "--clock", "frames", "--first-frame", 0)
    return at


def _joints(at: Path) -> Path:
    return at.with_name(f"{at.name}.trc")


def tracked(at: Path) -> Path:
    """Track a session."""
    quadrille("track", at, "--no-whole-run")
    return at


def body_of(footage: Footage, folder: Path) -> Path:
    """Acquire the body of the person under the right calibration."""
    at = tracked(started(footage, folder / f"{footage.name} body"))
    quadrille("acquire", at)
    return at / "models" / "person.toml"


def with_bodies(data: Path, folder: Path, names: Iterable[str]) -> dict[str, tuple[Footage, Path]]:
    """Write the images of recordings, and acquire the body of each; return both by the recording's name."""
    footages = {name: decoded(name, data / name, folder) for name in dict.fromkeys(names)}
    return {name: (footage, body_of(footage, folder)) for name, footage in footages.items()}


def error_mm(at: Path) -> float:
    """Return the mean error of the joints."""
    joints = _joints(at)
    return float(quadrille("evaluate", at, "--reference", joints, "--clock", "frames", "--first-frame", 0)["mpjpe_mm"])


def repaired(at: Path) -> list[dict[str, Any]]:
    """Correct what is named and track again, until nothing is; return what each check that named something said."""
    out = list[dict[str, Any]]()
    for _ in range(MAX_ROUNDS):
        try:
            result = quadrille("check", at, "--apply")
        except SystemExit as refused:
            print(refused, flush=True)
            break
        if not result["named"]:
            break
        out.append(result)
        tracked(at)
    return out


def off(camera: str, values: Sequence[float], calibration: Path, to: Path) -> Path:
    """Write a calibration in which a camera is off; see `BUMPS`."""
    c = np.zeros(N_CORRECTIONS)
    c[:3], c[3:6], c[6] = np.radians(values[:3]), np.array(values[3:6]) / 100, np.log1p(values[6] / 100)
    write_calibration(to, [corrected(x, c) if x.name == camera else x for x in read_calibration(calibration)])
    return to


def bumps(data: Path, folder: Path) -> Measured:
    """Correct `walk` under wrong calibrations."""
    walk = decoded("walk", data / "walk", folder)
    body, rows = body_of(walk, folder), {}
    healthy = error_mm(tracked(started(walk, folder / "healthy", body)))
    right = folder / "right.toml"
    write_calibration(right, read_calibration(folder / "healthy" / "calibration.toml"))
    for i, (words, values) in enumerate(BUMPS.items()):
        camera = walk.cameras[i % len(walk.cameras)]
        wrong = off(camera, values, right, folder / f"bump {i}.toml")
        at = tracked(started(walk, folder / f"bump {i}", body, wrong))
        rows[words] = _row(camera, error_mm(at), repaired(at), error_mm(at), healthy)
        print(words, rows[words], flush=True)
    camera = walk.cameras[0]
    wrong, errors = off(camera, BUMPS[FROM_NOTHING], right, folder / "nothing.toml"), []
    for name, calibration in (("from right", right), ("from wrong", wrong)):
        at = started(walk, folder / name, None, calibration)
        (at / "annotations.sqlite").unlink()
        quadrille("track", at, "--init", "auto", "--acquire", "--no-whole-run")
        errors.append(error_mm(at))
    words = f"{FROM_NOTHING}, people found and bodies acquired under it"
    rows[words] = _row(camera, errors[1], repaired(at), error_mm(at), errors[0])
    quadrille("track", at, "--acquire", "--no-whole-run")
    rows["the same, sizes acquired again"] = ["", "", "", f"{error_mm(at):.1f}", f"{errors[0]:.1f}"]
    said = conditions(
        "`walk`",
        "acquired under the right calibration, but in the last row",
        "the joints of frame 0, but in the last row",
    )
    return Measured("camera off by", ("camera", "named", "error, mm", "corrected", "with the right one"), rows, said)


def named_in_turn(found: Sequence[dict[str, Any]]) -> str:
    """Return the cameras that each check named, as a cell."""
    return ", then ".join(" and ".join(f["named"]) for f in found) or "none"


def _row(camera: str, before: float, found: Sequence[dict[str, Any]], after: float, healthy: float) -> list[str]:
    return [camera, named_in_turn(found), f"{before:.1f}", f"{after:.1f}", f"{healthy:.1f}"]


def clock_ms(at: Path, camera: str) -> tuple[float, float]:
    """Return by how much a camera is late by its clock, ms, and its drift, against the mean of the others."""
    session = load_session(at)
    clocks = {
        c.camera.name: np.array([1000 * c.clock.ahead_frames / session.fps, c.clock.rate]) for c in session.cameras
    }
    others = np.mean([v for k, v in clocks.items() if k != camera], axis=0)
    late, drift = clocks[camera] - others
    return float(late), float(drift)


def time(data: Path, folder: Path) -> Measured:
    """Shift the pictures of a camera in time."""
    child, man = (rendered(person, folder) for person in SIMULATED)
    walk, real = (decoded(name, data / name, folder) for name in ("walk", "balance_real"))
    cases, rows = ((child, 4), (man, 8), (walk, 2), (real, 2)), {}
    for i, (dense, every) in enumerate(cases):
        camera, label = dense.cameras[i], f"{dense.name.replace('_', ' ')}, {dense.fps / every:.0f} fps"
        plain = thinned(dense, folder / f"{dense.name} plain", max(1, round(dense.fps / 30)))
        trial = _Trial(dense, every, camera, body_of(plain, folder), folder / label)
        zero_ms = trial.found(0.0).late_ms if dense is real else 0.0
        cells = []
        for shift in SHIFTS[:1] if dense is real else SHIFTS:
            found, true = trial.found(shift), 1000 * shift * every / dense.fps
            off_ms = found.late_ms - zero_ms - true
            cells.append(f"{shift:g} ({true:.1f} ms): {off_ms:+.1f} ms after {len(found.checks)}")
            print(label, camera, cells[-1], flush=True)
        rows[label] = [camera, "; ".join(cells)]
        print(label, rows[label], flush=True)
    said = conditions(
        f"two simulated people rendered at {DENSE_FPS:g} frames a second, `walk` and `balance_real`, thinned; "
        "the error of `balance_real` is against what is found without a shift",
        "acquired from footage without a shift", "the joints of frame 0",
    )  # fmt: skip
    heads = ("camera", "frames late: error of the time found, after rounds of correction")
    return Measured("footage", heads, rows, said)


def drift(data: Path, folder: Path) -> Measured:
    """Let the clock of a camera drift."""
    rows = {}
    for person, played in DRIFTING.items():
        dense = rendered(person, folder, played, N_DRIFTING)
        every = round(dense.fps / 30)
        plain = thinned(dense, folder / f"{person} plain", every)
        camera, label = dense.cameras[0], f"{person.replace('_', ' ')}, {N_DRIFTING / 30:g} s"
        found = _Trial(dense, every, camera, body_of(plain, folder), folder / label).found(0.0, DRIFT)
        said = [next(c for c in f["cameras"] if c["name"] == camera) for f in found.checks]
        sigma = f"{said[-1]['sigma']['drift_ms_per_s'] / 1000:.4f}" if said else ""
        off = f"{found.drift:.4f} ({100 * (found.drift / DRIFT - 1):+.0f}%)"
        joints = f"{found.before_mm:.1f}", f"{found.after_mm:.1f}"
        rows[label] = [camera, named_in_turn(found.checks), off, sigma, *joints]
        print(label, rows[label], flush=True)
    conditions_of = conditions(
        f"simulated people rendered at {DENSE_FPS:g} frames a second, thinned to 30; one camera loses "
        f"{100 * DRIFT:g} frames of 100", "acquired from footage without a drift", "the joints of frame 0",
    )  # fmt: skip
    heads = ("camera", "named", f"drift found, of {DRIFT:g}", "standard deviation", "joints before, mm", "after, mm")
    return Measured("person", heads, rows, conditions_of._replace(chosen="none"))


class _Repair(NamedTuple):
    """Result of corrections for a camera that is late."""

    late_ms: float
    """By its corrected clock, against the mean of the others."""
    drift: float
    """The same, seconds a second."""
    checks: list[dict[str, Any]]
    """Answer of each check that named something."""
    before_mm: float
    """Mean error of the joints before the first correction."""
    after_mm: float
    """The same after the last one."""


class _Trial(NamedTuple):
    """Footage of which a camera is late."""

    dense: Footage
    every: int
    """Of so many images one is a frame."""
    camera: str
    body: Path
    folder: Path

    def found(self, shift: float, drift: float = 0.0) -> _Repair:
        """Track and correct until nothing is named.

        Args:
            shift: frames by which it is late.
            drift: frames a frame by which that grows.
        """
        at = self.folder.with_name(f"{self.folder.name}, {shift:g} late, drift {drift:g}")
        images = at.with_name(f"{at.name}, images")
        late = thinned(self.dense, images, self.every, lambda c, k: (shift + drift * k) * (c == self.camera))
        before_mm = error_mm(tracked(started(late, at, self.body)))
        checks = repaired(at)
        return _Repair(*clock_ms(at, self.camera), checks, before_mm, error_mm(at))


def lost(data: Path, folder: Path) -> Measured:
    """Let a camera lose frames within a recording."""
    rows, known = {}, with_bodies(data, folder, (case[0] for case in LOST))
    for name, index, since, n in LOST:
        footage, body = known[name]
        camera, label = footage.cameras[index], f"{name}, {n} before {since}"
        lost = {(camera, k): float(n) for k in range(since, footage.n_images)}
        late = thinned(footage, folder / f"{label}, images", late=lambda *at, lost=lost: lost.get(at, 0.0))
        at = tracked(started(late, folder / label, body))
        before_mm = error_mm(at)
        found = [
            (c["name"], c["lost_frames"], c["since_frame"]) for f in repaired(at) for c in f["cameras"] if c["kind"]
        ]
        said = "; ".join(f"{name}: {n} before {since}" for name, n, since in found) or "none"
        cells = [f"{camera}: {n} before {since}", said, f"{before_mm:.1f}", f"{error_mm(at):.1f}"]
        rows[label] = cells
        print(label, cells, flush=True)
    conditions_of = conditions(
        "recordings without some frames of a camera", "acquired from footage with all frames", "joints of frame 0"
    )
    heads = ("frames lost", "found", "joints before, mm", "after, mm")
    return Measured("recording", heads, rows, conditions_of)


def change(data: Path, folder: Path) -> Measured:
    """Turn a camera within a recording."""
    rows, known = {}, with_bodies(data, folder, (case[0] for case in CHANGES))
    for i, (name, index, since, angles) in enumerate(CHANGES):
        footage, body = known[name]
        camera = footage.cameras[index]
        turned = folder / f"turned {i}" / camera
        _turn(footage.folders[camera], _camera(footage, camera), since, np.radians(angles), turned)
        at = tracked(
            started(replace(footage, folders={**footage.folders, camera: turned}), folder / f"change {i}", body)
        )
        result = quadrille("check", at)
        said = [f"{c['name']} since {c['since_frame']}" for c in result["cameras"] if c["kind"] is not None]
        rows[f"{name.replace('_', ' ')}, {camera} since {since}"] = [f"{angles}", ", ".join(said) or "none"]
        print([*rows.items()][-1], flush=True)
    said = conditions(
        "recordings with the later frames of a camera warped as by a turn", "acquired", "joints of frame 0"
    )
    return Measured("turned camera", ("pitch, yaw, roll in degrees", "found"), rows, said)


def _camera(footage: Footage, name: str) -> Camera:
    return next(c for c in read_calibration(footage.calibration) if c.name == name)


def _turn(images: Path, camera: Camera, since: int, angles: Array, out: Path) -> None:
    """Write the images of a camera, from a frame on as it would show them turned."""
    out.mkdir(parents=True)
    H = camera.K @ so3_exp(angles) @ np.linalg.inv(camera.K)
    for k, path in enumerate(sorted(images.iterdir())):
        image: Image | None = cv2.imread(str(path))
        assert image is not None
        if k >= since:
            image = cv2.warpPerspective(image, H, camera.size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        cv2.imwrite(str(out / path.name), image)


def body(data: Path, folder: Path) -> Measured:
    """Refine the calibration of `balance_real` from the person in it."""
    real, rows = decoded("balance_real", data / "balance_real", folder), {}
    acquired = body_of(real, folder)
    at = tracked(started(real, folder / "real", acquired))
    session = load_session(at)
    half = session.n_frames // 2
    with open_observer(session.cameras) as observer:
        posed = PosedRecording.of_session(session, observer)
        for words, used in (("first", range(half)), ("second", range(half, session.n_frames))):
            check = check_calibration(posed, used)
            scores = held_out_scores(replace(posed, lost={*posed.lost, *used}), check, session.n_frames)
            rows[f"{words} half, the other judged"] = [
                ", ".join(check.named), f"{n_better(scores)} of {len(scores)}", "", "",
            ]  # fmt: skip
            print([*rows.items()][-1], flush=True)
    before, found = error_mm(at), repaired(at)
    rows["all frames, repeated"] = [named_in_turn(found), "", f"{before:.1f}", f"{error_mm(at):.1f}"]
    said = conditions("`balance_real`", "acquired", "joints of frame 0")
    heads = ("cameras corrected", "frames that fit better", "distance to the reference before, mm", "after, mm")
    return Measured("corrected by", heads, rows, said)


MEASURES: Mapping[str, Callable[[Path, Path], Measured]] = {
    "bumps": bumps, "time": time, "drift": drift, "lost": lost, "change": change, "body": body
}  # fmt: skip


def main() -> None:
    """Measure and print, or write the tables."""
    data, scratch = "folder with walk, fast_arms and balance_real", "folder for images, some gigabytes"
    parser = benchmark_parser(__doc__, ["data"], data=data, scratch=scratch)
    parser.add_argument("--only", nargs="+", choices=[*MEASURES], default=[*MEASURES], help="tables to measure")
    words = read_words(parser, TABLES)
    for name in (n for n in TABLES if n.split()[1] in words.only):
        with tempfile.TemporaryDirectory(dir=words.scratch) as folder:
            found = MEASURES[name.split()[1]](words.data, Path(folder))
        show(words.write, name, found.conditions, table(found.heads, found.rows, found.first))


if __name__ == "__main__":
    main()
