"""Measure which keyframes a run doubts: `python tests/benchmarks/keyframes_in_doubt.py`.

The single people of `unseen_people.py` are tracked. Then a person sets keyframes, and all is tracked again: three poses
that the run has right, moved by an unsteady hand; the same with a limb that the hand has put elsewhere; and the true
pose on the frame that the run had worst of those that it flags or has off. `--work DIR` keeps scenes and sessions, and
may be that of `unseen_people.py`.
"""

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from zlib import crc32

import numpy as np
from acquisition import quadrille
from between_keyframes import errors
from doc_tables import benchmark_parser, read_words, show, table, work_folder
from stored_motions import put_poses
from unseen_people import CONDITIONS, SCENES, SPARSE, Scene, acquired

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.fitting.hypothesis import distance_m
from tracker.evaluation.references import read_joints
from tracker.geometry.arrays import Array
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

TABLES = ("keyframes_in_doubt",)
RIGHT_MM, OFF_MM = 50.0, 100.0
"""Largest error of a joint of a frame that the run has right, and smallest of one that it has off."""
N_EACH = 3
"""Keyframes of a recording."""
HAND_M, HAND_RAD = 0.005, 0.012
"""Standard deviations of an unsteady hand. It tries again if a point ends more than `RIGHT_MM` elsewhere."""
ELSEWHERE_M = (0.15, 0.35)
"""By how much a limb is put elsewhere."""
KINDS = ("right, by an unsteady hand", "the same, a limb elsewhere", "true, where the run was worst")
HEADS = ("keyframes", "good", "doubtful", "lost")


def unsteady(model: BodyModel, pose: Array, rng: np.random.Generator) -> Array:
    """Return a pose as an unsteady hand sets it, (n_values,)."""
    sigmas = np.where(model.dof_is_length, HAND_M, HAND_RAD)
    return _moved(model, pose, lambda: rng.normal(0, sigmas), (0.0, RIGHT_MM / 1000))


def with_limb_elsewhere(model: BodyModel, pose: Array, rng: np.random.Generator) -> Array:
    """Return a pose with an arm or a leg elsewhere, (n_values,)."""
    of_parts = [limb for limb in limbs(model) if len(limb.parts) > 1]
    limb = of_parts[rng.integers(len(of_parts))]
    return _moved(model, pose, lambda: np.where(limb.dofs, rng.normal(0, 0.5, model.n_dofs), 0.0), ELSEWHERE_M)


def _moved(model: BodyModel, pose: Array, draw: Callable[[], Array], by_m: tuple[float, float]) -> Array:
    """Return a pose after the first step of some, (n_dofs,), by which the farthest point moves as far as is asked."""
    while True:
        other = model.clip(model.retract(pose, draw()))
        if by_m[0] < distance_m(PosedBody(model, other), PosedBody(model, pose)) < by_m[1]:
            return other


def keyframes(
    model: BodyModel, tracked: Mapping[int, StoredPose], reference: Path, fps: float
) -> Iterator[tuple[str, dict[int, Array]]]:
    """Yield each kind with its keyframes by frame, (n_values,) each."""
    bodies = {k: PosedBody(model, stored.body.values) for k, stored in tracked.items() if not stored.record.keyframe}
    worst_mm = dict(zip(bodies, np.nanmax(errors(bodies, reference, fps), axis=1), strict=True))
    right = [k for k, mm in worst_mm.items() if mm < RIGHT_MM]
    chosen = [right[len(right) * i // (N_EACH + 1)] for i in range(1, N_EACH + 1)]
    rngs = {k: np.random.default_rng([crc32(reference.parent.name.encode()), k]) for k in chosen}
    by_hand = {k: unsteady(model, bodies[k].values, rng) for k, rng in rngs.items()}
    yield KINDS[0], by_hand
    yield KINDS[1], {k: with_limb_elsewhere(model, by_hand[k], rng) for k, rng in rngs.items()}
    bad = [k for k, mm in worst_mm.items() if mm > OFF_MM or tracked[k].record.status != "good"]
    if bad:
        k, joints = max(bad, key=worst_mm.__getitem__), read_joints(reference, fps)
        row = joints.frames.tolist().index(k)
        known = dict(zip(joints.names, joints.points[row], strict=True))
        yield KINDS[2], {k: fit_to_points(model, known, bodies[k].values).pose}


def statuses(scene: Scene, folder: Path) -> Iterator[tuple[str, str]]:
    """Track a scene with keyframes; yield the kind and the status of each."""
    at, (reference,) = acquired(scene, folder)
    with tempfile.TemporaryDirectory() as scratch:
        first = Path(shutil.copytree(at, Path(scratch) / "first"))
        quadrille("track", first)
        session = load_session(first)
        (person,) = session.people
        tracked = read_stored_poses(session.annotations_path, person.name, person.model)
        for kind, poses in keyframes(person.model, tracked, reference, session.fps):
            again = Path(shutil.copytree(at, Path(scratch) / kind))
            path = load_session(again).annotations_path
            with AnnotationStore(path) as store:
                put_poses(store, person, poses, label="by hand", keyframe=True)
            quadrille("track", again)
            found = read_stored_poses(path, person.name, person.model)
            yield from ((kind, found[k].record.status) for k in poses)


def main() -> None:
    """Measure all scenes, and write the table."""
    given = read_words(benchmark_parser(__doc__, work="folder that keeps scenes and sessions"), TABLES)
    rows = {}
    with work_folder(given.work) as folder:
        for title, scenes in (("25 or 15 frames/s", SCENES), ("8 frames/s", SPARSE)):
            counts = {kind: Counter[str]() for kind in KINDS}
            for scene in (s for s in scenes if s.is_alone):
                for kind, status in statuses(scene, folder):
                    counts[kind][status] += 1
                print(scene.name, {kind: dict(own) for kind, own in counts.items()}, flush=True)
            for kind, own in counts.items():
                rows[f"{kind}; {title}"] = [str(own.total()), *(str(own[name]) for name in HEADS[1:])]
    conditions = CONDITIONS._replace(
        footage=CONDITIONS.footage.replace("25 or 15 frames/s", "25 or 15 frames/s and at 8"),
        settings="defaults",
        command="python tests/benchmarks/keyframes_in_doubt.py --write docs/log/accuracy.md",
    )
    show(given.write, TABLES[0], conditions, table(HEADS, rows, "keyframes that a person sets"))


if __name__ == "__main__":
    main()
