"""Measure the estimate of whole runs: `python tests/benchmarks/joint_errors.py SESSIONS --data DIR --scenes DIR`.

SESSIONS is a folder of sessions that have bodies and start poses, named as the recordings in `--data DIR` or as the
simulated people in `--scenes DIR`; a name may go on after `@`. Copies of them are tracked by the first pass
alone and by the whole run. The table has the error of the limb joints, frames with a joint that is off by more than
100 mm, and what the statuses are worth: the area under the curve, frames that are flagged, those of them that are fine,
and frames called good that are off. Coverage is the share of joints within their 90% ellipsoid. Processor times are
those of the whole command.
"""

import resource
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import RECORDED, quadrille
from doc_tables import Conditions, benchmark_parser, read_words, show, table
from scipy.stats import chi2, rankdata

from tracker.evaluation.references import read_joints
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.session.assemble import DEFAULT_MODEL
from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses

OFF_MM = 100.0
GROUPS = (
    "simulated, one person", "simulated, two people", "recordings, one person", "recordings, two people",
    "found from nothing",
)  # fmt: skip
CONDITIONS = Conditions(
    footage="recordings, and simulated people of another shape than the fitted body, in a furnished room with noise; "
    "four cameras with backgrounds",
    body=f"`{DEFAULT_MODEL}`, acquired; after `@nothing` of people who were found",
    start="pose fitted to the reference joints of frame 0; after `@nothing` the one that was found",
    settings="defaults, first pass → whole run",
    chosen="rules of tracking (recordings), the 10 nats of the colours (simulated people), the threshold of 5%, the "
    "median over the tracks, and the 15 mm by which joints lie elsewhere in people without known ones (recordings)",
    command="python tests/benchmarks/joint_errors.py SESSIONS --data DIR --scenes DIR --write docs/log/accuracy.md "
    "docs/measurements.md",
)
TABLES = ("joint_errors sums", "joint_errors")
HEADS = (
    "frames", "mean error, mm", "off", "area", "flagged", "flagged, yet fine", "good, yet off", "covered",
    "processor time",
)  # fmt: skip


class Assessed(NamedTuple):
    """The stored poses of a person against the reference."""

    errors_mm: np.ndarray
    """Of each limb joint, (T, 12); NaN where unknown."""
    odds: np.ndarray
    """Rank of the frames: the largest probability that a limb is lost, (T,)."""
    flagged: np.ndarray
    """Whether a frame is not good, (T,)."""
    covered: np.ndarray
    """Whether a joint lies in its 90% ellipsoid, (n,); empty without errors."""

    @property
    def off(self) -> np.ndarray:
        """Whether a joint of a frame is off, (T,)."""
        return np.nanmax(self.errors_mm, axis=1) > OFF_MM


class Compared(NamedTuple):
    """A person tracked by the first pass alone and by the whole run."""

    name: str
    """Session, and person where there are several."""
    first: Assessed
    whole: Assessed
    cost: float
    """Processor time of the whole run, as a multiple of that of the first pass."""

    @property
    def session(self) -> str:
        """Name of the session, with spaces."""
        return self.name.split(", ")[0]

    @property
    def cells(self) -> list[str]:
        """Cells of the table, in the order of `HEADS`."""
        a, b = self.first, self.whole
        return [
            str(len(b.off)),
            f"{np.nanmean(a.errors_mm):.1f} → {np.nanmean(b.errors_mm):.1f}",
            f"{a.off.sum()} → {b.off.sum()}",
            f"{area(a.odds, a.off):.2f} → {area(b.odds, b.off):.2f}".replace("nan", "–"),
            f"{a.flagged.sum()} → {b.flagged.sum()}",
            f"{(a.flagged & ~a.off).sum()} → {(b.flagged & ~b.off).sum()}",
            f"{(~a.flagged & a.off).sum()} → {(~b.flagged & b.off).sum()}",
            f"{100 * b.covered.mean():.0f}%" if len(b.covered) else "",
            f"x {self.cost:.1f}",
        ]


def processor_s() -> float:
    """Processor time of the programs that were run, seconds."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def area(scores: np.ndarray, is_off: np.ndarray) -> float:
    """Area under the curve; NaN where all or none are off."""
    n, m = is_off.sum(), (~is_off).sum()
    return float((rankdata(scores)[is_off].sum() - n * (n + 1) / 2) / (n * m)) if n and m else np.nan


def area_cell(scores: np.ndarray, is_off: np.ndarray, digits: int = 2) -> str:
    """Return the area under the curve as a cell; empty where all or none are off, or scores are the same."""
    return f"{area(scores, is_off):.{digits}f}" if is_off.any() and not is_off.all() and np.ptp(scores) else ""


def assessed(folder: Path, person: int, reference: Path) -> Assessed:
    """Compare the stored poses of a person with known joints."""
    session = load_session(folder)
    who = session.people[person]
    stored = read_stored_poses(session.annotations_path, who.name, who.model)
    joints = read_joints(reference, session.fps)
    known = dict(zip(joints.frames.tolist(), joints.points, strict=True))
    names = [n for n in joints.names if n in LIMB_JOINTS]
    of_file, of_body = [joints.names.index(n) for n in names], [who.model.point_names.index(n) for n in names]
    frames = [k for k, s in sorted(stored.items()) if k in known and not s.record.keyframe]
    steps = np.array([stored[k].body.joint_centers_world[of_body] - known[k][of_file] for k in frames])
    errors = [stored[k].record.errors for k in frames]
    covered = [
        np.einsum("ni,nij,nj->n", e, np.linalg.inv(own[of_body]), e) < chi2.ppf(0.9, 3)
        for e, own in zip(steps, errors, strict=True)
        if own is not None
    ]
    is_known = np.isfinite(steps[..., 0])
    return Assessed(
        1000 * np.linalg.norm(steps, axis=-1),
        np.array([max(stored[k].record.limbs_lost, default=0.0) for k in frames]),
        np.array([stored[k].record.status != "good" for k in frames]),
        np.concatenate([c[i] for c, i in zip(covered, is_known, strict=False)]) if covered else np.zeros(0),
    )


def measured(folder: Path, references: Sequence[Path], n_cameras: int | None = None) -> Iterator[Compared]:
    """Track copies of a session by the first pass and by the whole run; yield the comparison of each person.

    Args:
        folder: of the session.
        references: the known joints of each person.
        n_cameras: how many cameras are used, the first ones; None for all.
    """
    runs, seconds = [], []
    used = ("--cameras", *load_session(folder).camera_names[:n_cameras]) if n_cameras else ()
    for options in (("--no-whole-run",), ()):
        with tempfile.TemporaryDirectory() as scratch:
            at = Path(shutil.copytree(folder, Path(scratch) / "session"))
            before = processor_s()
            quadrille("track", at, *options, *used)
            seconds.append(processor_s() - before)
            runs.append([assessed(at, i, path) for i, path in enumerate(references)])
    for reference, first, whole in zip(references, *runs, strict=True):
        name = folder.name + (f", {reference.stem}" if len(references) > 1 else "")
        if len(first.off):
            yield Compared(name.replace("_", " "), first, whole, seconds[1] / seconds[0])


def pooled(name: str, found: Sequence[Compared]) -> Compared:
    """Return all frames of several people as one; limb joints that are unknown for one of them do not count."""

    def together(runs: Sequence[Assessed]) -> Assessed:
        n = max(r.errors_mm.shape[1] for r in runs)
        errors = [np.pad(r.errors_mm, ((0, 0), (0, n - r.errors_mm.shape[1])), constant_values=np.nan) for r in runs]
        return Assessed(np.concatenate(errors), *(np.concatenate([r[i] for r in runs]) for i in (1, 2, 3)))

    first, whole = together([c.first for c in found]), together([c.whole for c in found])
    return Compared(name, first, whole, float(np.mean([c.cost for c in found])))


def groups(found: Sequence[Compared], names: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the rows of the sums. `names` has the sessions of each group by its title; empty groups are left out."""
    members = {title: [c for c in found if c.session in sessions] for title, sessions in names.items()}
    return {title: pooled(title, own).cells for title, own in members.items() if own}


def references_of(name: str, data: Path, scenes: Path | None) -> list[Path]:
    """Return the reference of each person of a session."""
    name = name.split("@")[0]
    if name in RECORDED:
        return [data / name / f"ground_truth_{p}.trc" for p in RECORDED[name]] or sorted((data / name).glob("*.trc"))[
            :1
        ]
    return sorted((scenes / name).glob("truth*.trc")) if scenes is not None else []


def group_of(session: str, n_people: int) -> str:
    """Return the group whose sums a session belongs to."""
    if "@" in session:
        return "found from nothing"
    kind = "recordings" if session.replace(" ", "_") in RECORDED else "simulated"
    return f"{kind}, {'one person' if n_people == 1 else 'two people'}"


def main() -> None:
    """Measure all sessions, and write both tables."""
    scenes = "folder of the simulated recordings"
    parser = benchmark_parser(__doc__, ["data"], data="folder of the recordings", scenes=scenes)
    parser.add_argument("sessions", type=Path)
    given = read_words(parser, TABLES)
    found: list[Compared] = []
    names: dict[str, list[str]] = {title: [] for title in GROUPS}
    for folder in sorted(p for p in given.sessions.iterdir() if (p / "session.toml").exists()):
        known = references_of(folder.name, given.data, given.scenes)
        for compared in measured(folder, known) if known else ():
            found.append(compared)
            names[group_of(compared.session, len(known))].append(compared.session)
            print(f"{compared.name}: {' | '.join(compared.cells)}", flush=True)
    show(given.write, TABLES[0], CONDITIONS, table(HEADS, groups(found, names), "people"))
    show(given.write, TABLES[1], CONDITIONS, table(HEADS, {c.name: c.cells for c in found}, "session"), True)


if __name__ == "__main__":
    main()
