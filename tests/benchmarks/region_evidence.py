"""Measure region evidence on tracked recordings: `python tests/benchmarks/region_evidence.py SESSIONS --data DIR`.

SESSIONS is a folder of sessions that are named as the recordings in DIR, or as the simulated people in `--scenes DIR`.
A name may go on after a hyphen. Prints a table: the area under the curve of how much likelier a limb is elsewhere for
"a joint of that limb is off by more than 100 mm", beside that of the stored probability that the limb is lost; first of
limbs, then of frames, by their worst limb. Then the limbs that are likelier elsewhere by more than `SELDOM_NATS`: those
that are off, and the others. Nothing is fitted to errors. The head does not count: references differ in its joints.

`--displaced` measures errors that the tracker does not make often enough: 7% of the limbs are put where they are on
another frame, and refined there without the prediction. No stored probabilities belong to these poses. Poses are learnt
from as they are, wrong ones included.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import RECORDED
from doc_tables import table
from joint_errors import area_cell
from numpy.typing import NDArray
from true_starts import joint_centers, limb_joints

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.appearance.region_model import (
    LearningFrame,
    RegionModel,
    elsewhere_nats,
    learn_regions,
    learning_frames,
    worst_parts,
)
from tracker.estimation.by_frame.frame_problem import Bodies, prediction_sigmas, with_body
from tracker.estimation.by_frame.pose_score import common_evidence, scorer_without_prediction
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.pose_errors import SELDOM_NATS
from tracker.estimation.tracking.view_regions import regions
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import Observer, open_observer
from tracker.evidence.view_evidence import EdgeSettings
from tracker.geometry.arrays import Array
from tracker.session.session import Session, load_session
from tracker.session.store.stored_poses import read_stored_poses

OFF_MM = 100.0
DISPLACED_SHARE, SEED = 0.07, 5
HEADS = (
    "limbs off", "area, lost", "area, elsewhere", "frames off", "area, lost", "area, elsewhere", "off, found",
    "others, found", "learn, ms", "score, ms",
)  # fmt: skip
SETTINGS = TrackSettings()


@dataclass(frozen=True)
class Tracked:
    """A tracked recording with known joints. Tuples and first axes are of its people."""

    session: Session
    frames: list[int]
    bodies: list[Bodies]
    """All people, on each frame."""
    is_keyframe: NDArray[np.bool_]
    """(n_people, T)."""
    lost: tuple[Array, ...]
    """Stored probability that each limb is lost, (T, n_limbs) each; NaN where not assessed."""
    joints: tuple[dict[int, dict[str, Array]], ...]
    """Known limb joints by frame and name, metres."""

    @property
    def models(self) -> list[BodyModel]:
        """Body of each person."""
        return [body.model for body in self.bodies[0]]

    def errors_mm(self, bodies: Sequence[Bodies], person: int) -> Array:
        """Return the largest error of a joint of each limb on each frame, (T, n_limbs), mm; NaN if unknown."""
        known, model = self.joints[person], self.models[person]
        out = np.full((len(bodies), len(limbs(model))), np.nan)
        for row, frame, people in zip(out, self.frames, bodies, strict=True):
            found = joint_centers(model, people[person].values)
            for i, limb in enumerate(limbs(model)):
                of_limb = [
                    n for n in known.get(frame, {}) if model.point_parts[model.point_names.index(n)] in limb.parts
                ]
                if of_limb:
                    row[i] = 1000 * max(np.linalg.norm(found[n] - known[frame][n]) for n in of_limb)
        return out


class Measured(NamedTuple):
    """The region evidence of a recording."""

    known: RegionModel
    elsewhere: Array
    """See `elsewhere_nats`; of the worst part of each limb, (T, n_limbs)."""
    learn_ms: float
    """Processor time of learning, for each frame learnt from."""
    score_ms: float
    """Processor time of scoring a frame."""


def read_tracked(folder: Path, references: Sequence[Path]) -> Tracked:
    """Read a session and the true joints of its people."""
    session = load_session(folder)
    stored = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
    frames = sorted(set.intersection(*(set(s) for s in stored)))
    lost = []
    for own in stored:
        n = len(limbs(own[frames[0]].body.model))
        lost.append(np.array([own[k].record.limbs_lost or [np.nan] * n for k in frames]))
    joints = tuple(limb_joints(read_joints(path, session.fps)) for path in references)
    bodies = [tuple(own[k].body for own in stored) for k in frames]
    is_keyframe = np.array([[own[k].record.keyframe for k in frames] for own in stored])
    return Tracked(session, frames, bodies, is_keyframe, tuple(lost), joints)


def displaced(tracked: Tracked, observer: Observer) -> list[Bodies]:
    """Return the bodies with some limbs where they are on other frames, refined there."""
    rng, out = np.random.default_rng(SEED), list[Bodies]()
    for k, (frame, people) in enumerate(zip(tracked.frames, tracked.bodies, strict=True)):
        bodies, moved = people, set[int]()
        for i, model in enumerate(tracked.models):
            for limb in limbs(model):
                other = tracked.bodies[rng.integers(len(tracked.frames))][i]
                if limb.name == "head" or rng.random() >= DISPLACED_SHARE or tracked.is_keyframe[i, k]:
                    continue
                step = np.where(limb.dofs, model.difference(other.values, bodies[i].values), 0.0)
                bodies = with_body(bodies, i, PosedBody(model, model.clip(model.retract(bodies[i].values, step))))
                moved.add(i)
        views = common_evidence(observer, frame, [bodies, people], SETTINGS) if moved else ()
        for i in moved:
            model, scorer = tracked.models[i], scorer_without_prediction(views, bodies, i, SETTINGS)
            refined = scorer.refined(model, [bodies[i].values], prediction_sigmas(model, SETTINGS))[0]
            bodies = with_body(bodies, i, PosedBody(model, refined))
        out.append(bodies)
    return out


def measure(tracked: Tracked, bodies: Sequence[Bodies], observer: Observer) -> Measured:
    """Learn region evidence from some frames, and score all."""
    cameras, colors_only = observer.working_cameras, EdgeSettings(foreground=False)
    views = [
        observer.evidence(frame, regions(cameras, people), edges=colors_only)
        for frame, people in zip(tracked.frames, bodies, strict=True)
    ]
    chosen = learning_frames(range(len(views)))
    began = time.process_time()
    known = learn_regions([LearningFrame(views[k], bodies[k]) for k in chosen], cameras, observer.empty_scenes())
    learnt = time.process_time()
    scores = [known.score(known.frame(v, b), b) for v, b in zip(views, bodies, strict=True)]
    scored = time.process_time()
    of_parts = elsewhere_nats(np.array([score.nats.sum(axis=0) for score in scores]), tracked.models)
    elsewhere = np.take_along_axis(of_parts, worst_parts(of_parts, tracked.models), axis=1)
    return Measured(known, elsewhere, 1e3 * (learnt - began) / len(chosen), 1e3 * (scored - learnt) / len(views))


def _first_limbs(models: Sequence[BodyModel]) -> list[int]:
    """Return the index of the first limb of each person."""
    return np.cumsum([0, *(len(limbs(m)) for m in models)])[:-1].tolist()


def rows(tracked: Tracked, is_displaced: bool) -> Iterator[list[str]]:
    """Yield the cells of each person, in the order of `HEADS`."""
    with open_observer(tracked.session.cameras) as observer:
        bodies = displaced(tracked, observer) if is_displaced else tracked.bodies
        measured = measure(tracked, bodies, observer)
    for i, first in enumerate(_first_limbs(tracked.models)):
        names = [x.name for x in limbs(tracked.models[i])]
        error = tracked.errors_mm(bodies, i)
        lost = np.zeros_like(error) if is_displaced else tracked.lost[i]
        elsewhere = measured.elsewhere[:, first : first + len(names)]
        use = np.isfinite(error) & np.isfinite(lost) & (np.array(names) != "head") & ~tracked.is_keyframe[i][:, None]
        chosen, off, found = use.any(axis=1), error > OFF_MM, elsewhere > SELDOM_NATS
        lost_of_frame, elsewhere_of_frame, off_frame = (
            np.where(use, of_limb, -np.inf).max(axis=1)[chosen] for of_limb in (lost, elsewhere, off)
        )
        off_frame = off_frame > 0
        yield [
            f"{off[use].sum()} of {use.sum()}", area_cell(lost[use], off[use]), area_cell(elsewhere[use], off[use]),
            f"{off_frame.sum()} of {len(off_frame)}", area_cell(lost_of_frame, off_frame),
            area_cell(elsewhere_of_frame, off_frame), f"{(found & off & use).sum()} of {(off & use).sum()}",
            f"{(found & ~off & use).sum()} of {(~off & use).sum()}", f"{measured.learn_ms:.1f}",
            f"{measured.score_ms:.1f}",
        ]  # fmt: skip


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sessions", type=Path, help="folder of tracked sessions")
    parser.add_argument("--data", type=Path, help="folder of recordings")
    parser.add_argument("--scenes", type=Path, help="folder of simulated recordings")
    parser.add_argument("--only", nargs="+", help="names of sessions")
    parser.add_argument("--displaced", action="store_true", help="put limbs elsewhere first")
    words = parser.parse_args()
    found = dict[str, list[str]]()
    for folder in sorted(words.sessions.iterdir()):
        name = folder.name.split("-")[0]
        root = words.data if name in RECORDED else words.scenes
        if (
            root is None
            or not (folder / "annotations.sqlite").exists()
            or folder.name not in (words.only or [folder.name])
        ):
            continue
        references = sorted((root / name).glob("*.trc"))
        tracked = read_tracked(folder, references)
        for person, cells in zip(tracked.session.people, rows(tracked, words.displaced), strict=True):
            label = folder.name if len(references) == 1 else f"{folder.name}, {person.name}"
            found[label] = cells
            print(f"{label}: {', '.join(cells)}", flush=True)
    print(table(HEADS, found, "recording"))


if __name__ == "__main__":
    main()
