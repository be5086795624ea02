"""Measure poses between keyframes: `python tests/benchmarks/between_keyframes.py SESSIONS --data DIR`.

SESSIONS is a folder of sessions with acquired bodies, named as the recordings in `--data DIR`. In copies of them every
15th frame becomes a keyframe, fitted to the reference joints. The frames between are tracked from both keyframes,
tracked forward alone, or interpolated on the pose manifold. Errors are of the frames between two keyframes. The rank
correlation is that of the seam, the largest distance of a limb joint in the two passes, with the mean error of the
frame.
"""

import shutil
import tempfile
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import RECORDED, quadrille
from doc_tables import Conditions, benchmark_parser, read_words, show, table
from joint_errors import processor_s, references_of
from scipy.stats import spearmanr

from tracker.body.model import PosedBody
from tracker.body.motion.interpolation import interpolate_pose
from tracker.evaluation.references import read_joints
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses

EVERY = 15
"""Frames from a keyframe to the next."""
LOST_MM = 150.0
TABLES = ("between_keyframes",)
HEADS = ("frames", "whole run", "first pass", "interpolated", "lost", "seam and error", "processor time")
CONDITIONS = Conditions(
    footage="recordings, four cameras with backgrounds",
    body=f"`{DEFAULT_MODEL}`, acquired from the reference joints of frame 0",
    start=f"keyframes on every {EVERY}th frame, fitted to the reference joints",
    settings="defaults. Mean error over the limb joints of frames between two keyframes, mm: by the whole run, by the "
    "first pass alone, interpolated. *Lost:* frames with a joint off by more than 150 mm, by the same. *Seam and "
    "error:* rank correlation. Processor time: of the whole run, as a multiple of the first pass",
    chosen="rules of tracking; none of the passes from both keyframes",
    command="python tests/benchmarks/between_keyframes.py SESSIONS --data DIR --write docs/log/annotation.md",
)


class Between(NamedTuple):
    """Errors of the frames between two keyframes."""

    errors_mm: np.ndarray
    """Of each limb joint, (T, 12); NaN where unknown."""
    seams_mm: np.ndarray
    """(T,); NaN where there is none."""
    seconds: float
    """Processor time."""

    @property
    def mean_mm(self) -> float:
        """Mean error, mm."""
        return float(np.nanmean(self.errors_mm))

    @property
    def n_lost(self) -> int:
        """Number of lost frames."""
        return int((np.nanmax(self.errors_mm, axis=1) > LOST_MM).sum())

    @property
    def correlation(self) -> float:
        """Rank correlation of the seam with the mean error of the frame."""
        return float(spearmanr(self.seams_mm, np.nanmean(self.errors_mm, axis=1))[0])


def with_keyframes(folder: Path, references: list[Path]) -> list[int]:
    """Make every 15th frame of a session a keyframe, fitted to the reference joints; return their numbers."""
    session = load_session(folder)
    frames = list(range(0, session.n_frames, EVERY))
    for person, reference in zip(session.people, references, strict=True):
        for k in frames:
            quadrille("init", folder, "--joints", reference, "--frame", k, "--person", person.name)
    return frames


def measured(folder: Path, person: int, reference: Path, keyframes: list[int], seconds: float = 0.0) -> Between:
    """Compare the stored poses between keyframes with known joints."""
    who = load_session(folder).people[person]
    stored = read_stored_poses(load_session(folder).annotations_path, who.name, who.model)
    bodies = {k: s.body for k, s in stored.items() if keyframes[0] < k < keyframes[-1] and k not in keyframes}
    seams = [stored[k].record.seam_mm for k in bodies]
    return Between(errors(bodies, reference, load_session(folder).fps), np.array(seams, dtype=float), seconds)


def interpolated(folder: Path, person: int, reference: Path, keyframes: list[int]) -> Between:
    """Compare poses that are interpolated between keyframes with known joints."""
    session = load_session(folder)
    who = session.people[person]
    stored, bodies = read_stored_poses(session.annotations_path, who.name, who.model), {}
    for a, b in pairwise(keyframes):
        frames = np.arange(a + 1, b)
        poses = interpolate_pose(who.model, stored[a].body.values, stored[b].body.values, (frames - a) / (b - a))
        bodies |= {int(k): PosedBody(who.model, pose) for k, pose in zip(frames, poses, strict=True)}
    return Between(errors(bodies, reference, session.fps), np.full(len(bodies), np.nan), 0.0)


def errors(bodies: Mapping[int, PosedBody], reference: Path, fps: float) -> np.ndarray:
    """Return the errors of the limb joints, (T, n), mm."""
    joints = read_joints(reference, fps)
    known = dict(zip(joints.frames.tolist(), joints.points, strict=True))
    names = [n for n in joints.names if n in LIMB_JOINTS]
    columns = [joints.names.index(n) for n in names]
    rows = []
    for k, body in bodies.items():
        at = [body.model.point_names.index(n) for n in names]
        rows.append(1000 * np.linalg.norm(body.joint_centers_world[at] - known[k][columns], axis=1))
    return np.array(rows)


def rows_of(folder: Path, references: list[Path]) -> dict[str, list[str]]:
    """Track copies of a session in both ways; return the cells of each person."""
    runs = list[list[Between]]()
    with tempfile.TemporaryDirectory() as scratch:
        start = Path(shutil.copytree(folder, Path(scratch) / "start"))
        keyframes = with_keyframes(start, references)
        by_hand = [interpolated(start, i, path, keyframes) for i, path in enumerate(references)]
        for options in ((), ("--no-whole-run",)):
            at = Path(shutil.copytree(start, Path(scratch) / f"run_{len(runs)}"))
            before = processor_s()
            quadrille("track", at, *options)
            seconds = processor_s() - before
            runs.append([measured(at, i, path, keyframes, seconds) for i, path in enumerate(references)])
    out = {}
    for i, (reference, whole, first) in enumerate(zip(references, *runs, strict=True)):
        name = folder.name.replace("_", " ") + (f", {reference.stem}" if len(references) > 1 else "")
        ways = whole, first, by_hand[i]
        out[name] = [
            str(len(whole.seams_mm)),
            *(f"{way.mean_mm:.1f}" for way in ways),
            ", ".join(str(way.n_lost) for way in ways),
            f"{whole.correlation:.2f}",
            f"x {whole.seconds / first.seconds:.1f}",
        ]
    return out


def main() -> None:
    """Measure all recordings, and write the table."""
    parser = benchmark_parser(__doc__, ["data"], data="folder of the recordings")
    parser.add_argument("sessions", type=Path)
    parser.add_argument("--only", nargs="+", help="names of the recordings to measure")
    given = read_words(parser, TABLES)
    rows: dict[str, list[str]] = {}
    for name in (n for n in RECORDED if n in (given.only or RECORDED)):
        for row, cells in rows_of(given.sessions / name, references_of(name, given.data, None)).items():
            rows[row] = cells
            print(f"{row}: {' | '.join(cells)}", flush=True)
    show(given.write, TABLES[0], CONDITIONS, table(HEADS, rows, "recording"))


if __name__ == "__main__":
    main()
