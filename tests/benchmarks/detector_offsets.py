"""Measure constant offsets of a detector's joints: `python tests/benchmarks/detector_offsets.py --data DIR --work DIR`.

Simulated people of all builds are detected by BlazePose's heavy network. The mean offset of each joint from the true
one, in the frame of its proximal body part and as a share of the body height, is learned over them: left and right
joints are mirror images. Two people at a time are left out, and the offsets of the others are taken off their joints.
On recordings they are taken off twice: of the detector's joints, and before a body is posed by key points alone, which
learns offsets of the run by itself. `QUADRILLE_MODELS` names the folder of the networks.
"""

import argparse
import os
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import RECORDED, new_session, recorded
from doc_tables import Conditions, add_write_option, check_places, show, table

from tracker.body.model import PosedBody
from tracker.estimation.acquisition.body_points import BodyPoints
from tracker.estimation.acquisition.from_keypoints import fit_to_keypoints, learn_offsets
from tracker.evaluation.references import read_joints
from tracker.footage.recording import Recording as Footage
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table
from tracker.interchange.detection.detect import DetectionPlan, detect_people
from tracker.interchange.detection.detectors import load_detector
from tracker.interchange.detection.model_files import default_folder
from tracker.pipeline.keypoint_evidence import at_observed_height, read_points
from tracker.session.session import Session, load_session
from tracker.simulate import Simulation, simulate
from tracker.simulate.people.population import POPULATION

TABLES = ("detector_offsets", "detector_offsets recordings")
SEED, N_FRAMES, FPS, NAME = 4401, 10, 5.0, "net"
MOTIONS = ("exercise", "dance", "reach_and_cross")
JOINTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
MIRROR = np.array([1.0, -1.0, 1.0])
HEADS = ("forward, mm/m", "outward, mm/m", "up, mm/m", "between people, mm/m", "error of people left out, mm")
RECORDING_HEADS = ("detector's joints, mm", "posed by key points alone, mm", "the same, but for ankles, mm")
CONDITIONS = Conditions(
    footage=f"simulated people of all builds, {N_FRAMES} frames each at {FPS:.0f} frames/s, four cameras, seed {SEED}",
    body="the true skeleton; offsets are from its joints, in the frames of its parts, in mm per metre of stature",
    start="none: no body is tracked",
    settings="BlazePose, heavy; errors are plain → without the mean offset of the other people",
    chosen="none",
    command="python tests/benchmarks/detector_offsets.py --data DIR --write docs/observations.md",
)
RECORDING_CONDITIONS = CONDITIONS._replace(
    footage="recordings without backgrounds",
    body="the default body at the height that the key points show",
    start="key points",
    settings="BlazePose, heavy; mean error of the limb joints, plain → without the mean offset of all simulated people",
)

Offsets = Mapping[str, np.ndarray]
"""From the body's joint to the detector's in the frame of its proximal part, y outward, (3,), shares of the stature."""


class Detected(NamedTuple):
    """A person who was detected and is known."""

    name: str
    height_m: float
    points: BodyPoints
    bodies: Mapping[int, PosedBody]
    """Whose parts have the frames of the offsets, by frame."""


def detected(session: Session) -> Session:
    """Detect the people of a session on all frames, unless that is done."""
    if not (session.folder / "observations" / NAME).exists():
        folder = Path(os.environ.get("QUADRILLE_MODELS") or default_folder())
        detector, name = load_detector("blazepose", "heavy", folder)
        with Footage(session.cameras) as footage:
            detect_people(session, footage, detector, DetectionPlan(NAME, name, range(session.n_frames)))
    return session


def played(folder: Path) -> Iterator[Detected]:
    """Film and detect the simulated people, unless that is done."""
    for i, name in enumerate(POPULATION):
        at = folder / name
        if not at.exists():
            simulate(at, Simulation(MOTIONS[i % 3], 4, N_FRAMES, SEED + i, fps=FPS, person=name))
        session = detected(load_session(at))
        model, poses = load_model(at / "truth_model.toml"), read_pose_table(at / "truth.csv")
        values = poses.values_for(model)
        assert values is not None
        bodies = {int(k): PosedBody(model, v) for k, v in zip(poses.frames, values, strict=True)}
        yield Detected(name, model.height_m, read_points(session, NAME)[0].known_to(model), bodies)


def side_of(name: str) -> tuple[str, np.ndarray]:
    """Return the joint of a point, and the signs that make y point outward."""
    side, _, joint = name.partition("_")
    return joint, np.ones(3) if side == "left" else MIRROR


def offsets_of(person: Detected) -> Offsets:
    """Return the offsets of a person, left and right together."""
    found: dict[str, list[np.ndarray]] = {}
    own = learn_offsets(person.bodies, person.points) / person.height_m
    for name, offset in zip(person.points.names, own, strict=True):
        joint, signs = side_of(name)
        found.setdefault(joint, []).append(signs * offset)
    return {joint: np.mean(some, axis=0) for joint, some in found.items()}


def mean_of(found: list[Offsets]) -> Offsets:
    """Return the mean offset of each joint over people."""
    return {joint: np.mean([own[joint] for own in found], axis=0) for joint in found[0]}


def without(person: Detected, offsets: Offsets) -> BodyPoints:
    """Return the points of a person without offsets, on the frames of the bodies."""
    out = np.full_like(person.points.joints_world, np.nan)
    for k, body in person.bodies.items():
        of_body = [body.model.point_names.index(n) for n in person.points.names]
        R = body.kinematics.Ts_world_part[body.model.proximal_parts[of_body], :3, :3]
        own = [side_of(n)[1] * offsets.get(side_of(n)[0], np.zeros(3)) for n in person.points.names]
        out[k] = person.points.joints_world[k] - np.einsum("nij,nj->ni", R, person.height_m * np.array(own))
    return replace(person.points, joints_world=out)


def errors_mm(points: BodyPoints, true: Mapping[int, Mapping[str, np.ndarray]], joints: tuple[str, ...]) -> float:
    """Return the mean distance of points from the true joints of some names, mm."""
    found = [
        np.linalg.norm(place - true[k][name])
        for k in true
        if k < len(points.joints_world)
        for name, place in points.places(k).items()
        if name in true[k] and name in joints
    ]
    return 1000 * float(np.nanmean(found))


def of_bodies(bodies: Mapping[int, PosedBody]) -> dict[int, dict[str, np.ndarray]]:
    """Return the joint centers of bodies by frame and name."""
    return {k: dict(zip(b.model.point_names, b.joint_centers_world, strict=True)) for k, b in bodies.items()}


def left_out(people: list[Detected]) -> dict[str, str]:
    """Return the error of joints of people who are left out, plain and without the offsets of the others."""
    groups = {joint: (joint,) for joint in JOINTS} | {"all but ankles": JOINTS[:-1], "all": JOINTS}
    sums: dict[str, list[tuple[float, float]]] = {}
    for pair in (people[i : i + 2] for i in range(0, len(people), 2)):
        others = mean_of([offsets_of(p) for p in people if p.name not in {own.name for own in pair}])
        for person in pair:
            true, mended = of_bodies(person.bodies), without(person, others)
            for title, joints in groups.items():
                names = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in joints)
                both = errors_mm(person.points, true, names), errors_mm(mended, true, names)
                sums.setdefault(title, []).append(both)
            print(f"{person.name}: {both[0]:.1f} → {both[1]:.1f}", flush=True)
    return {joint: " → ".join(f"{v:.1f}" for v in np.mean(some, axis=0)) for joint, some in sums.items()}


def rows_of(people: list[Detected]) -> dict[str, list[str]]:
    """Return the rows of the table of simulated people."""
    found, errors = [offsets_of(p) for p in people], left_out(people)
    mean, out = mean_of(found), dict[str, list[str]]()
    for joint in JOINTS:
        spread = np.sqrt(np.var([own[joint] for own in found], axis=0).sum() * len(found) / (len(found) - 1))
        out[joint] = [*(f"{1000 * v:+.1f}" for v in mean[joint]), f"{1000 * spread:.1f}", errors[joint]]
    return out | {title: ["", "", "", "", errors[title]] for title in errors if title not in out}


def posed(person: Detected) -> BodyPoints:
    """Return the joints of a body that is fitted to the points of a person."""
    model = next(iter(person.bodies.values())).model
    out = np.full_like(person.points.joints_world, np.nan)
    for k, body in fit_to_keypoints(model, person.points).items():
        out[k] = body.joint_centers_world[[model.point_names.index(n) for n in person.points.names]]
    return replace(person.points, joints_world=out)


def recording_rows(data: Path, folder: Path, offsets: Offsets) -> Iterator[tuple[str, list[str]]]:
    """Detect the recordings; yield the cells of each person."""
    for recording in recorded(data, [*RECORDED]):
        at = folder / recording.name / recording.name
        made = at if at.exists() else new_session(replace(recording, background=None), at.parent)
        session = detected(load_session(made))
        points = read_points(session, NAME)
        for i, (name, reference) in enumerate(recording.references.items()):
            joints = read_joints(reference, session.fps)
            rows = zip(joints.frames.tolist(), joints.points, strict=True)
            true = {k: dict(zip(joints.names, row, strict=True)) for k, row in rows}
            seen = min(points.values(), key=lambda own: errors_mm(own, true, LIMB_JOINTS))
            model = at_observed_height(session.people[i].model, seen)
            person = Detected(name, model.height_m, seen, fit_to_keypoints(model, seen))
            own, mended = posed(person), without(person, offsets)
            but_ankles = without(person, {j: o for j, o in offsets.items() if j != "ankle"})
            pairs = [(seen, mended), *((own, posed(person._replace(points=p))) for p in (mended, but_ankles))]
            cells = [" → ".join(f"{errors_mm(p, true, LIMB_JOINTS):.1f}" for p in pair) for pair in pairs]
            title = recording.name + f", {name}" * (len(recording.references) > 1)
            print(title, cells, flush=True)
            yield title.replace("_", " "), cells


def main() -> None:
    """Learn the offsets, and write both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of the recordings")
    parser.add_argument("--work", type=Path, help="folder that keeps scenes and what was detected")
    add_write_option(parser)
    given = parser.parse_args()
    check_places(given.write, TABLES)
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.work or Path(scratch)
        folder.mkdir(exist_ok=True)
        people = list(played(folder))
        show(given.write, TABLES[0], CONDITIONS, table(HEADS, rows_of(people), "joint"))
        if given.data:
            rows = dict(recording_rows(given.data, folder, mean_of([offsets_of(p) for p in people])))
            show(given.write, TABLES[1], RECORDING_CONDITIONS, table(RECORDING_HEADS, rows, "recording"))


if __name__ == "__main__":
    main()
