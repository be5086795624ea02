"""Measure imported observations: `python tests/benchmarks/observations.py --data DIR`.

The key points of each recording's folder `detector` are imported. One table compares tracking by the detector alone, by
contours alone and by both, from nothing; without backgrounds, too. The other has the judgement of the key points: of
their real errors, of 200 errors that are injected, and of the true joints.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import new_session, quadrille, recorded
from doc_tables import Conditions, benchmark_parser, read_words, show, table, work_folder
from joint_errors import area_cell

from tracker.api.work import ProgressSink
from tracker.estimation.acquisition.from_keypoints import PersonObservations
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.pose_errors import OFF_M
from tracker.evaluation.judging.judge import Judgement, judge, judge_person
from tracker.evaluation.judging.verdicts import LIMBS
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording as Footage
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import MarkerTable
from tracker.session.session import load_session

NAMES = ("walk", "fast_arms", "balance_real")
TABLES = ("observations tracked", "observations judged")
NAME, LISTED, ROUNDS, INJECTED = "detector", 20, 25, 8
TRACKED_HEADS = ("detector's joints", "key points alone", "contours alone", "both", "both, no background")
JUDGED_HEADS = ("limbs off", "area", f"wrong of the first {LISTED}", "flagged, of those off", "flagged, of the others")
COMMAND = "python tests/benchmarks/observations.py --data DIR --write docs/log/observations.md"
TRACKED = Conditions(
    footage="recordings; key points by a network in each view (`detector`)",
    body="acquired from the footage and the key points; no height, joint or pose is given",
    start="found by `--init auto`, by key points where these are evidence",
    settings="`quadrille track --init auto --acquire --evidence ...`; each cell is the mean error of the 12 limb "
    "joints in mm / frames with one of them off by more than 150 mm",
    chosen="the 2.5 cm of the offset of observed joints, and that sizes are acquired with them (`walk`, `fast_arms`); "
    "those of the contours see the other tables",
    command=COMMAND,
)
JUDGED = TRACKED._replace(
    start="key points",
    settings="`quadrille judge`; a limb is off where a joint is farther than 100 mm from the reference; injected are "
    f"{INJECTED} errors in each of {ROUNDS} rounds: legs exchanged on 5 to 20 frames, drifts of up to 50 to 300 mm, "
    "jumps of 50 to 150 mm of a joint",
    chosen="those of the tracking, as above; of the judge none",
)


class Truth(NamedTuple):
    """Reference joints by frame."""

    joints: MarkerTable

    def off(self, points: PersonObservations, frame: int, limb: str) -> bool | None:
        """Return whether a limb of some joints is off; None where that is not known."""
        row = np.flatnonzero(self.joints.frames == frame)
        known = [n for n in LIMBS[limb] if n in points.names and n in self.joints.names]
        if not len(row) or not known:
            return None
        there = self.joints.points[row[0], [self.joints.names.index(n) for n in known]]
        found = points.joints_world[frame][[points.names.index(n) for n in known]]
        errors = np.linalg.norm(found - there, axis=1)
        return bool(np.nanmax(errors) > OFF_M) if np.isfinite(errors).any() else None


def compared(folder: Path, data: Path, name: str) -> tuple[Path, list[str]]:
    """Track a recording by each evidence; return the session of the imported key points, and the cells."""
    (recording,) = recorded(data, [name])
    (person, reference), *_ = recording.references.items()
    joints = data / name / "detector" / "detector_joints.trc"
    cells = [detector_cell(joints, reference, load_session(new_session(recording, folder / "plain")).fps)]
    first: Path | None = None
    for words, has_background in (
        (("keypoints",), True), (("contours",), True), (("both",), True), (("both",), False)
    ):  # fmt: skip
        made = recording if has_background else replace(recording, background=None)
        at = new_session(made, folder / f"{words[0]}-{has_background}")
        quadrille("import", at, data / name / "detector" / "keypoints", "--as", NAME)
        first = first or at
        acquires = [] if words == ("keypoints",) else ["--acquire"]
        of = [] if words == ("contours",) else ["--of", NAME]
        quadrille("track", at, "--init", "auto", *acquires, "--evidence", words[0], *of)
        found = quadrille("evaluate", at, "--reference", reference, "--person", person)
        cells.append(f"{found['mpjpe_mm']:.1f} / {found['lost_frames']}")
        print(f"{name}, {words[0]}{'' if has_background else ', no background'}: {cells[-1]}", flush=True)
    assert first is not None
    return first, cells


def detector_cell(joints: Path, reference: Path, fps: float) -> str:
    """Return the mean error of the detector's own joints, and the frames with one that is off."""
    found, true = read_joints(joints, fps), read_joints(reference, fps)
    common = sorted({*found.frames.tolist()} & {*true.frames.tolist()})
    names = [n for n in LIMB_JOINTS if n in found.names and n in true.names]
    places = [t.points[np.isin(t.frames, common)][:, [t.names.index(n) for n in names]] for t in (found, true)]
    errors = np.linalg.norm(places[0] - places[1], axis=2)
    return f"{1000 * np.nanmean(errors):.1f} / {int((np.nanmax(errors, axis=1) > 0.15).sum())}"


def judged(at: Path, reference: Path) -> Iterator[tuple[str, list[str]]]:
    """Judge the key points of a session, then with injected errors, then the true joints."""
    session = load_session(at)
    truth = Truth(read_joints(reference, session.fps))
    with Footage(session.cameras) as footage:
        (found,) = judge(session, Observer(session.cameras, footage), NAME, TrackSettings(), ProgressSink(None))
    yield f"{session.name}", cells([found], truth)
    points, random = found.imported, np.random.default_rng(0)
    rounds = [injected(points, random) for _ in range(ROUNDS)]
    again = [judge_person("person", p, found.tracked, None, session.fps) for p in rounds]
    yield f"{session.name}, injected", cells(again, truth)
    true = replace(points, joints_world=_true(points, truth.joints))
    yield f"{session.name}, true joints", cells([judge_person("person", true, found.tracked, None, session.fps)], truth)


def cells(found: list[Judgement], truth: Truth) -> list[str]:
    """Return the cells of some judgements together, in the order of `JUDGED_HEADS`."""
    off, scores, first = list[bool](), list[float](), list[bool]()
    for own in found:
        for k, limbs in own.frames.items():
            for limb, verdict in limbs.items():
                is_off = truth.off(own.imported, k, limb)
                if is_off is not None:
                    off.append(is_off)
                    scores.append(verdict.probability_off)
        first += [bool(truth.off(own.imported, d.frame, d.limb)) for d in own.worst[:LISTED]]
    is_off, score = np.array(off), np.array(scores)
    flagged = score >= 1 - score  # as `LimbVerdict.is_doubted`
    percent = [f"{100 * flagged[chosen].mean():.0f}%" if chosen.any() else "" for chosen in (is_off, ~is_off)]
    wrong = f"{sum(first) / len(found):.1f}" if is_off.sum() >= LISTED * len(found) else ""
    return [f"{is_off.sum()} of {len(off)}", area_cell(score, is_off, 3), wrong, *percent]


def injected(points: PersonObservations, random: np.random.Generator) -> PersonObservations:
    """Return joints with errors: legs exchanged, limbs that drift, joints that jump."""
    joints, at = points.joints_world.copy(), {n: i for i, n in enumerate(points.names)}
    for _ in range(INJECTED):
        n = int(random.integers(5, 21))
        first, kind = int(random.integers(0, len(joints) - n)), int(random.integers(3))
        frames, limb = slice(first, first + n), list(LIMBS)[int(random.integers(4))]
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        if kind == 0:
            for left, right in zip(LIMBS["left leg"], LIMBS["right leg"], strict=True):
                joints[frames, [at[left], at[right]]] = joints[frames, [at[right], at[left]]]
        elif kind == 1:
            drift = np.linspace(0, random.uniform(0.05, 0.3), n)[:, None] * direction
            for joint in LIMBS[limb][1:]:
                joints[frames, at[joint]] += drift
        else:
            joints[frames, at[LIMBS[limb][int(random.integers(3))]]] += random.uniform(0.05, 0.15) * direction
    return replace(points, joints_world=joints)


def _true(points: PersonObservations, truth: MarkerTable) -> np.ndarray:
    out = np.full_like(points.joints_world, np.nan)
    for i, name in enumerate(points.names):
        if name in truth.names:
            rows = truth.frames < len(out)
            out[truth.frames[rows], i] = truth.points[rows, truth.names.index(name)]
    return out


if __name__ == "__main__":
    parser = benchmark_parser(__doc__, ["data"], data="folder with walk, fast_arms and balance_real")
    parser.add_argument("--only", nargs="+", default=NAMES, help="recordings to print; the tables stay")
    words = read_words(parser, TABLES)
    tracked_rows, judged_rows = dict[str, list[str]](), dict[str, list[str]]()
    with work_folder(None) as folder:
        for name in words.only:
            at, tracked_rows[name] = compared(folder / name, words.data, name)
            (recording,) = recorded(words.data, [name])
            for label, row in judged(at, next(iter(recording.references.values()))):
                judged_rows[label] = row
                print(f"{label}: {', '.join(map(' '.join, zip(JUDGED_HEADS, row, strict=True)))}", flush=True)
    places = words.write if tuple(words.only) == NAMES else []
    show(places, TABLES[0], TRACKED, table(TRACKED_HEADS, tracked_rows, "recording"))
    show(places, TABLES[1], JUDGED, table(JUDGED_HEADS, judged_rows, "joints"), is_repeated=False)
