"""Calibrate cameras by people and compare: `python tests/benchmarks/person_calibration.py --data DIR`.

Recordings have key points of a detector (`detector/keypoints`) and a calibration. The found cameras are compared with
the given ones after the best similarity of all joints, because neither shares a world or a scale. Simulated people have
noise of 3 px and gross errors (`tests/support/filmed_people.py`). Several people, and people on one spot, also have
offsets of each joint, and hide each other (`tests/support/detected_people.py`).
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from board_rigs import rms_error_m
from detected_people import acted, detected, filmed_couple
from doc_tables import Conditions, benchmark_parser, read_words, show, table
from filmed_people import aligned, blanks, dancing, observed, rig

from tracker.calibration.check.point_problem import triangulate_all
from tracker.calibration.check.rig_adjustment import Observations
from tracker.calibration.self_calibration.keypoint_calibration import calibrate_by_person
from tracker.calibration.self_calibration.person_calibration import PersonCalibration
from tracker.calibration.self_calibration.person_files import footage_session, plan_of_files
from tracker.errors import CalibrationError
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.observed import ObservationSet, triangulate_observations
from tracker.simulate.stage.camera_rig import make_cameras

KINDS = ("recordings", "simulated", "several", "alone")
TABLES = (
    "person_calibration recordings", "person_calibration simulated", "person_calibration several",
    "person_calibration alone",
)  # fmt: skip
LENS_NAMES = {False: "unknown lenses", True: "given lenses"}
HEADS = (
    "centres, mm", "rotations, degrees", "focal lengths, %", "joints, median / rms, mm", "expected, mm",
    "scale, %", "up, degrees", "held out, median / rms, px",
)  # fmt: skip
HEIGHTS_M = {"walk": None, "fast_arms": 1.55, "balance_real": None}
"""Heights that the recordings state."""
TRIMMED = 0.95
"""Share of the joints that the similarity is fitted to: joints of gross errors depend on the choice of views."""
FIRST_SEED = 100
N_SEEDS = 4
"""Cameras and motions of each scene of a person alone."""
SCENES_ALONE = ("exercise", "reach_and_cross", "walk_in_place", "leaving")
PEOPLE_ALONE = ("", "child_10")
N_SEVERAL, N_ALONE = 60, 20
"""Frames of several people, and of those without names the first ones, on which one of them is alone."""
COMMAND = "python tests/benchmarks/person_calibration.py --data DIR --write docs/log/calibration.md"


class Compared(NamedTuple):
    """Found cameras against given ones."""

    centers_mm: Array
    rotations_deg: Array
    joints_mm: Array
    scale: float
    tilt_deg: float


def compared(found: Sequence[Camera], given: Sequence[Camera], joints: Array, expected: Array) -> Compared:
    """Compare cameras after the similarity that leads joints, (n, 3), to expected ones."""
    chosen = np.arange(len(joints))
    for _ in range(4):
        scale, R, t = aligned(joints[chosen], expected[chosen])
        errors = np.linalg.norm(scale * joints @ R.T + t - expected, axis=1)
        chosen = np.argsort(errors)[: int(TRIMMED * len(errors))]
    centers = [
        np.linalg.norm(scale * R @ a.center_world + t - b.center_world) for a, b in zip(found, given, strict=True)
    ]
    turns = [b.T_world_camera[:3, :3].T @ R @ a.T_world_camera[:3, :3] for a, b in zip(found, given, strict=True)]
    angles = [np.degrees(np.linalg.norm(rigid.so3_log(turn))) for turn in turns]
    tilt = np.degrees(np.arccos(np.clip(R[2, 2], -1, 1)))
    return Compared(1000 * np.array(centers), np.array(angles), 1000 * errors, scale, float(tilt))


def joints_of(observations: ObservationSet, cameras: Sequence[Camera]) -> Array:
    """Triangulate the joints of the person, (F, N, 3)."""
    return triangulate_observations(observations, cameras).joints.joints_world[:, 0]


def keypoint_row(folder: Path, height_m: float | None, has_lenses: bool) -> list[str]:
    """Calibrate the cameras of a recording by key points, and return a row of the table."""
    paths, given, observations, unknown = _recording(folder)
    lenses = [given[name] for name in paths] if has_lenses else unknown
    calibration = calibrate_by_person(observations, lenses, height_m, has_lenses)
    return recording_row(folder, calibration, height_m, has_lenses)


def _recording(folder: Path) -> tuple[dict[str, Path], dict[str, Camera], ObservationSet, list[Camera]]:
    entries = {e.name: e.camera() for e in read_cameras(folder / "Calib.toml").entries}
    paths = {p.stem: p for p in sorted(folder.glob("*.mp4"))}
    session = footage_session(folder, paths, {}, common_frames=False)
    plan = plan_of_files(session, folder / "detector/keypoints")
    return paths, entries, plan.observations, [c.camera for c in session.cameras]


def recording_row(folder: Path, found: PersonCalibration, height_m: float | None, has_lenses: bool) -> list[str]:
    """Compare found cameras with the given ones, by joints that both triangulate from key points."""
    paths, entries, observations, _ = _recording(folder)
    given = [entries[name] for name in paths]
    joints, expected = (joints_of(observations, c) for c in (found.cameras, given))
    known = np.isfinite(joints).all(axis=-1) & np.isfinite(expected).all(axis=-1)
    off = compared(found.cameras, given, joints[known], expected[known])
    most = np.sort(off.joints_mm)[: int(TRIMMED * known.sum())]
    focal = [100 * np.log(a.K[0, 0] / b.K[0, 0]) for a, b in zip(found.cameras, given, strict=True)]
    return [
        f"{np.mean(off.centers_mm):.0f} (to {np.max(off.centers_mm):.0f})",
        f"{np.mean(off.rotations_deg):.1f} (to {np.max(off.rotations_deg):.1f})",
        "given" if has_lenses else f"{min(focal):+.0f} to {max(focal):+.0f}, said {_said(found)}",
        f"{np.median(off.joints_mm):.1f} / {np.sqrt(np.mean(most**2)):.1f}",
        f"{1000 * found.volume.expected_m:.1f} ({1000 * found.volume.low_m:.1f} to {1000 * found.volume.high_m:.1f})",
        f"{100 * (1 / off.scale - 1):+.0f}" if height_m is not None else "height unknown",
        f"{off.tilt_deg:.1f}",
        f"{np.median(found.held_out.px):.1f} / {found.held_out.rms_px():.1f}",
    ]


def _said(found: PersonCalibration) -> str:
    return f"± {100 * np.mean(found.adjusted.fit.focal_sigmas):.0f}"


def simulated_row(n_rigs: int, n_cameras: int, arc: float, has_lenses: bool) -> list[str]:
    """Calibrate simulated rigs, and return a row of the table."""
    inside, ratios, true_mm, refused = [], [], [], 0
    for seed in range(FIRST_SEED, FIRST_SEED + n_rigs):
        cameras, points = rig(n_cameras, arc), dancing(20, seed)
        lenses = cameras if has_lenses else blanks(cameras)
        try:
            calibration = calibrate_by_person(observed(cameras, points, seed=seed), lenses, has_lenses=has_lenses)
        except CalibrationError:
            refused += 1
            continue
        joints = calibration.world.joints_world
        known = np.isfinite(joints).all(axis=-1)
        scale = compared(calibration.cameras, cameras, joints[known], points[known]).scale
        scaled = [replace(c, T_world_camera=_scaled(c.T_world_camera, scale)) for c in calibration.cameras]
        true = rms_error_m(cameras, scaled, points.reshape(-1, 3)[::7])
        inside.append(scale * calibration.volume.low_m <= true <= scale * calibration.volume.high_m)
        ratios.append(true / scale / calibration.volume.expected_m)
        true_mm.append(1000 * true)
        print(n_cameras, has_lenses, seed, f"{true_mm[-1]:.1f} {ratios[-1]:.2f} {inside[-1]}", flush=True)
    if not inside:
        return [f"{refused}", "-", "-", "-"]
    return [f"{refused}", f"{np.median(true_mm):.1f} (to {np.max(true_mm):.1f})", f"{np.median(ratios):.2f}",
            f"{np.mean(inside):.0%}"]  # fmt: skip


def several_row(cameras: Sequence[Camera], joints: Array, heights_m, is_named: bool, has_lenses: bool) -> list[str]:
    """Calibrate cameras by several people, (F, P, 25, 3), and return a row of the table."""
    names = [*(heights_m or map(str, range(joints.shape[1])))]
    tracks = [names] * len(cameras) if is_named else None
    seen = detected(cameras, joints, FIRST_SEED, alone=0 if is_named else N_ALONE, tracks=tracks)
    try:
        found = calibrate_by_person(
            seen, cameras if has_lenses else blanks(cameras), heights_m if is_named else None, has_lenses
        )
    except CalibrationError as error:
        return [f"refused: {str(error).split(';')[0]}", *[""] * 6]
    true = joints.reshape(-1, 3)[np.isfinite(joints).all(axis=-1).ravel()]
    off = compared(found.cameras, cameras, reprojected(cameras, found.cameras, true)[0], true)
    focal = [100 * np.log(a.K[0, 0] / b.K[0, 0]) for a, b in zip(found.cameras, cameras, strict=True)]
    return [
        f"{np.mean(off.centers_mm):.0f} (to {np.max(off.centers_mm):.0f})",
        "given" if has_lenses else f"{min(focal):+.0f} to {max(focal):+.0f}, said {_said(found)}",
        f"{np.median(off.joints_mm):.1f} / {np.sqrt(np.mean(off.joints_mm**2)):.1f}",
        f"{1000 * found.volume.expected_m:.1f} ({1000 * found.volume.low_m:.1f} to {1000 * found.volume.high_m:.1f})",
        f"{100 * (1 / off.scale - 1):+.0f}" if heights_m and is_named else "height unknown",
        f"{off.tilt_deg:.1f}",
        f"{found.identified.n_left_out}",
    ]


def alone_row(scene: str, has_lenses: bool) -> list[str]:
    """Calibrate cameras by people who are alone, and return a row of the table."""
    joints_mm, expected_mm, n_outside, n_reversed, refused = [], [], 0, 0, 0
    for person, seed in product(PEOPLE_ALONE, range(FIRST_SEED, FIRST_SEED + N_SEEDS)):
        cameras, (joints, heights) = make_cameras(4, (640, 480), seed), acted(scene, N_ALONE, seed, person=person)
        try:
            calibration = calibrate_by_person(
                detected(cameras, joints, seed),
                cameras if has_lenses else blanks(cameras),
                *heights.values(),
                has_lenses,
            )
        except CalibrationError as error:
            refused += 1
            print(scene, person, seed, has_lenses, f"refused: {str(error).split(';')[0]}", flush=True)
            continue
        true = joints.reshape(-1, 3)[np.isfinite(joints).all(axis=-1).ravel()]
        off = compared(calibration.cameras, cameras, reprojected(cameras, calibration.cameras, true)[0], true)
        joints_mm.append(np.sqrt(np.mean(np.sort(off.joints_mm)[: int(TRIMMED * len(true))] ** 2)))
        expected_mm.append(1000 * calibration.volume.expected_m)
        n_outside += off.scale * 1000 * calibration.volume.high_m < joints_mm[-1]
        n_reversed += off.rotations_deg.max() > 90
        print(scene, person, seed, has_lenses, f"{joints_mm[-1]:.1f} {expected_mm[-1]:.1f}", flush=True)
    errors = [f"{np.median(mm):.1f} (to {np.max(mm):.1f})" if mm else "-" for mm in (joints_mm, expected_mm)]
    return [f"{refused}", f"{n_reversed}", f"{n_outside}", *errors]


def reprojected(cameras: Sequence[Camera], found: Sequence[Camera], points: Array) -> tuple[Array, Mask]:
    """Project points, (n, 3), by true cameras; triangulate them by found ones, and return which are determined, too."""
    px = np.stack([c.project(points) for c in cameras])
    views, numbers = np.indices(px.shape[:2]).reshape(2, -1)
    return triangulate_all(found, Observations(views, numbers, px.reshape(-1, 2)))


def _scaled(T_world_camera: Array, scale: float) -> Array:
    return rigid.transform(T_world_camera[:3, :3], scale * T_world_camera[:3, 3])


def read_arguments(description: str | None, kinds: Sequence[str], tables: Sequence[str]) -> argparse.Namespace:
    """Read the words of a benchmark of recordings and of simulated rigs."""
    parser = benchmark_parser(description, data="folder of the recordings; without it, simulated people only")
    parser.add_argument("--only", nargs="+", choices=kinds, default=kinds, help="tables to measure")
    parser.add_argument("--rigs", type=int, default=20, help="number of simulated rigs of each kind")
    return read_words(parser, tables)


def main():
    """Measure and print, or write the tables."""
    arguments = read_arguments(__doc__, KINDS, TABLES)
    if arguments.data is not None and "recordings" in arguments.only:
        measure_recordings(arguments.data, arguments.write)
    if "simulated" in arguments.only:
        measure_simulated(arguments.rigs, arguments.write)
    if "several" in arguments.only:
        measure_several(arguments.data, arguments.write)
    if "alone" in arguments.only:
        measure_alone(arguments.write)


def measure_recordings(data: Path, write: Sequence[Path]):
    """Write the table of recordings."""
    cells = {
        f"`{name}`, {LENS_NAMES[lenses]}": keypoint_row(data / name, height_m, lenses)
        for name, height_m in HEIGHTS_M.items()
        for lenses in (False, True)
    }
    conditions = Conditions(
        "`walk` (60 frames), `fast_arms` (50) and `balance_real` (100) with the key points of MediaPipe Pose 0.10.21, "
        "four cameras each",
        "one person; only `fast_arms` has a stated height, 1.55 m",
        "nothing, or the lenses of the given calibration",
        "defaults",
        "cameras with pictures of one size have one focal length, after `fast_arms` had shown that each alone is not "
        "determined; nothing else",
        COMMAND,
    )
    show(write, TABLES[0], conditions, table(HEADS, cells, "recording"))


def measure_simulated(n_rigs: int, write: Sequence[Path]):
    """Write the table of simulated people."""
    rigs = {
        "4 cameras around, unknown lenses": (4, 2 * np.pi, False),
        "4 cameras around, given lenses": (4, 2 * np.pi, True),
        "3 cameras over 140 degrees, unknown lenses": (3, 2.5, False),
        "2 cameras at 70 degrees, unknown lenses": (2, 1.2, False),
        "2 cameras at 70 degrees, given lenses": (2, 1.2, True),
    }
    cells = {name: simulated_row(n_rigs, *each) for name, each in rigs.items()}
    conditions = Conditions(
        f"{n_rigs} simulated people of each kind, 20 frames, noise of 3 px, 5% gross errors, independent of each other",
        "`gavrila38` of 1.70 m",
        "nothing, or the true lenses",
        "defaults",
        "none",
        COMMAND,
    )
    heads = ("refused", "true error, median, mm", "true / expected", "within 90%")
    show(write, TABLES[1], conditions, table(heads, cells, "cameras"))


def measure_several(data: Path | None, write: Sequence[Path]):
    """Write the table of several people."""
    footage = {
        f"`{scene}`": (make_cameras(4, (640, 480), FIRST_SEED), *acted(scene, N_SEVERAL, FIRST_SEED))
        for scene in ("couple_apart", "couple_near", "tango", "crowd_of_three")
    }
    if data is not None:
        entries = read_cameras(data / "two_people" / "Calib.toml").entries
        footage["`two_people`"] = [e.camera() for e in entries], filmed_couple(data / "two_people"), None
    cells = {
        f"{name}, {'names' if is_named else 'one alone at first'}, {LENS_NAMES[lenses]}": several_row(
            *recording, is_named, lenses
        )
        for name, recording in footage.items()
        for is_named in (True, False)
        for lenses in (False, True)
    }
    conditions = Conditions(
        f"true joints of simulated scenes and of `two_people`, {N_SEVERAL} frames, four cameras. Each joint of each "
        "person has a constant offset of 3 px (standard deviation), noise of 2 px, and 4% gross errors of 60 px; 80% "
        "of the joints behind a nearer person and 10% of the others are absent. People are in random order. "
        f"Either all have names, or none has and one person is alone on the first {N_ALONE} frames",
        "those of the scenes; heights are stated with names, but for `two_people`",
        "nothing, or the true lenses",
        "defaults",
        "the comparison of names, after `couple_apart` with other seeds had shown that two people who hardly move "
        "were taken for each other in one camera; the refusal of people who do not fit, after two of these rows had "
        "been wrong by metres",
        COMMAND,
    )
    heads = (
        "centres, mm", "focal lengths, %", "joints, median / rms, mm", "expected, mm", "scale, %", "up, degrees",
        "pictures left out",
    )  # fmt: skip
    show(write, TABLES[2], conditions, table(heads, cells, "people"))


def measure_alone(write: Sequence[Path]):
    """Write the table of people who are alone."""
    cells = {
        f"`{scene}`, {LENS_NAMES[lenses]}": alone_row(scene, lenses)
        for scene in SCENES_ALONE
        for lenses in (True, False)
    }
    conditions = Conditions(
        f"true joints of simulated scenes, {N_ALONE} frames of 25 a second, four cameras, two people and {N_SEEDS} "
        "seeds each, with the errors of the table of several people",
        "those of the scenes, an adult and a child; heights are stated",
        "nothing, or the true lenses",
        "defaults",
        "none on these seeds; the fault was studied on seeds 0 to 12 of these scenes",
        COMMAND,
    )
    heads = (
        "refused", "a camera off by 90 degrees", "joints above the interval", "joints, rms, median, mm",
        "expected, median, mm",
    )  # fmt: skip
    show(write, TABLES[3], conditions, table(heads, cells, "scene"))


if __name__ == "__main__":
    main()
