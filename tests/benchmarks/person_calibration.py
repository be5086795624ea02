"""Calibrate cameras by a person and compare: `python tests/benchmarks/person_calibration.py --data DIR`.

Recordings have key points of a detector (`detector/keypoints`) and a calibration. `walk` and `fast_arms` have exact
masks, too; silhouettes of `balance_real` are those of the footage against its own median. The found cameras are
compared with the given ones after the best similarity of all joints, because neither shares a world or a scale.
Simulated people have noise of 3 px and gross errors (`tests/support/filmed_people.py`). Several people also have
offsets of each joint, and hide each other (`tests/support/detected_people.py`).
Simulated people have noise of 3 px and gross errors (`tests/support/filmed_people.py`), or are rendered masks
(`tests/support/filmed_silhouettes.py`).
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
from doc_tables import Conditions, add_write_option, check_places, show, table
from filmed_people import aligned, blanks, dancing, observed, rig
from filmed_silhouettes import EXACT, FilmedSilhouettes, Segmentation, filmed

from tracker.calibration.point_adjustment import triangulate_all
from tracker.calibration.reprojection import Observations
from tracker.calibrations.reading import read_cameras
from tracker.compute.progress import unreported
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.observations.joints import triangulate_observations
from tracker.observations.observed import ObservationSet
from tracker.self_calibration.keypoint_calibration import calibrate_by_person
from tracker.self_calibration.keypoint_files import FilmedPerson, KeyPoints, calibrate_filmed_person, read_keypoints
from tracker.self_calibration.person_calibration import PersonCalibration
from tracker.self_calibration.silhouette_calibration import calibrate_by_silhouettes
from tracker.simulate.people.population import POPULATION
from tracker.simulate.stage.camera_rig import make_cameras

KINDS = ("recordings", "silhouettes", "simulated", "several", "alone", "simulated silhouettes")
TABLES = (
    "person_calibration recordings", "person_calibration silhouettes", "person_calibration simulated",
    "person_calibration several", "person_calibration alone", "person_calibration simulated silhouettes",
)  # fmt: skip
MASKS = {"walk": "masks", "fast_arms": "masks", "balance_real": None}
"""Folder of masks; None where the footage shows silhouettes."""
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
FIRST_FILMED_SEED = 9200
SEGMENTATIONS = {
    "exact": EXACT,
    "borders with noise of 1 px, 3 holes": Segmentation(noise_px=1.0, holes=3),
    "a rim of 1 px": Segmentation(dilation_px=1.0),
}
MOTIONS = ("exercise", "dance", "reach_and_cross", "walk_in_place")
FILMED_FRAMES = 24
COMMAND = "python tests/benchmarks/person_calibration.py --data DIR --write docs/calibration.md"


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
    paths, given, keypoints = _recording(folder)
    lenses = [given[name] for name in paths] if has_lenses else keypoints.blanks
    return _row(folder, calibrate_by_person(keypoints.observations, lenses, height_m, has_lenses), height_m, has_lenses)


def silhouette_row(folder: Path, height_m: float | None, has_lenses: bool) -> list[str]:
    """Calibrate the cameras of a recording by silhouettes, and return a row of the table."""
    masks = MASKS[folder.name]
    paths = {p.stem: p for p in sorted(folder.glob("*.mp4"))}
    lenses = folder / "Calib.toml" if has_lenses else None
    filmed = FilmedPerson(folder / masks if masks else None, [*paths.values()], stature_m=height_m, lenses=lenses)
    return _row(folder, calibrate_filmed_person(filmed, unreported), height_m, has_lenses)


def _recording(folder: Path) -> tuple[dict[str, Path], dict[str, Camera], KeyPoints]:
    entries = {e.name: e.camera() for e in read_cameras(folder / "Calib.toml").entries}
    paths = {p.stem: p for p in sorted(folder.glob("*.mp4"))}
    return paths, entries, read_keypoints(folder / "detector/keypoints", paths, {}, common_frames=False)


def _row(folder: Path, found: PersonCalibration, height_m: float | None, has_lenses: bool) -> list[str]:
    """Compare found cameras with the given ones, by joints that both triangulate from key points."""
    paths, entries, keypoints = _recording(folder)
    given = [entries[name] for name in paths]
    joints, expected = (joints_of(keypoints.observations, c) for c in (found.cameras, given))
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
        f"{np.median(found.held_out_px):.1f} / {found.held_out_rms_px():.1f}",
    ]


def _said(found: PersonCalibration) -> str:
    return f"± {100 * np.mean(found.adjusted.focal_sigmas):.0f}"


def simulated_row(n_rigs: int, n_cameras: int, arc: float, has_lenses: bool) -> list[str]:
    """Calibrate simulated rigs, and return a row of the table."""
    inside, ratios, true_mm, refused = [], [], [], 0
    for seed in range(FIRST_SEED, FIRST_SEED + n_rigs):
        cameras, points = rig(n_cameras, arc), dancing(20, seed)
        lenses = cameras if has_lenses else blanks(cameras)
        try:
            found = calibrate_by_person(observed(cameras, points, seed=seed), lenses, has_lenses=has_lenses)
        except CalibrationError:
            refused += 1
            continue
        joints = found.world.joints_world
        known = np.isfinite(joints).all(axis=-1)
        scale = compared(found.cameras, cameras, joints[known], points[known]).scale
        scaled = [replace(c, T_world_camera=_scaled(c.T_world_camera, scale)) for c in found.cameras]
        true = rms_error_m(cameras, scaled, points.reshape(-1, 3)[::7])
        inside.append(scale * found.volume.low_m <= true <= scale * found.volume.high_m)
        ratios.append(true / scale / found.volume.expected_m)
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
    off = compared(found.cameras, cameras, reprojected(cameras, found.cameras, true), true)
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
            found = calibrate_by_person(
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
        off = compared(found.cameras, cameras, reprojected(cameras, found.cameras, true), true)
        joints_mm.append(np.sqrt(np.mean(np.sort(off.joints_mm)[: int(TRIMMED * len(true))] ** 2)))
        expected_mm.append(1000 * found.volume.expected_m)
        n_outside += off.scale * 1000 * found.volume.high_m < joints_mm[-1]
        n_reversed += off.rotations_deg.max() > 90
        print(scene, person, seed, has_lenses, f"{joints_mm[-1]:.1f} {expected_mm[-1]:.1f}", flush=True)
    errors = [f"{np.median(mm):.1f} (to {np.max(mm):.1f})" if mm else "-" for mm in (joints_mm, expected_mm)]
    return [f"{refused}", f"{n_reversed}", f"{n_outside}", *errors]


def reprojected(cameras: Sequence[Camera], found: Sequence[Camera], points: Array) -> Array:
    """Project points, (n, 3), by true cameras, and triangulate them by found ones."""
    px = np.stack([c.project(points) for c in cameras])
    views, numbers = np.indices(px.shape[:2]).reshape(2, -1)
    return triangulate_all(found, Observations(views, numbers, px.reshape(-1, 2)))[0]


class Calibrated(NamedTuple):
    """A simulated rig that silhouettes have calibrated."""

    true_mm: float
    ratio: float
    """True error over the expected one."""
    is_inside: bool
    scale: float
    """Error of the scale, as a share."""
    scale_sigmas: float
    """The same in stated standard deviations."""


def by_silhouettes(film: FilmedSilhouettes, n_cameras: int, has_lenses: bool) -> Calibrated | None:
    """Calibrate some cameras by the silhouettes of a simulated person; None where that is refused."""
    cameras, rows = film.cameras[:n_cameras], [row[:n_cameras] for row in film.rows]
    lenses = cameras if has_lenses else blanks(cameras)
    try:
        found = calibrate_by_silhouettes(rows, lenses, film.height_m, has_lenses)
    except CalibrationError as error:
        print(str(error).split(";")[0], flush=True)
        return None
    points = film.joints_world.reshape(-1, 3)[::5]
    px = np.concatenate([c.project(points) for c in cameras])
    numbers = np.tile(np.arange(len(points)), n_cameras)
    seen = Observations(np.repeat(np.arange(n_cameras), len(points)), numbers, px)
    joints, known = triangulate_all(found.cameras, seen)
    scale, R, t = aligned(joints[known], points[known])
    errors = np.linalg.norm(scale * joints[known] @ R.T + t - points[known], axis=1)
    true, volume = float(np.sqrt(np.mean(errors**2))) / scale, found.volume
    off = 1 / scale - 1
    is_inside = bool(volume.low_m <= true <= volume.high_m)
    return Calibrated(1000 * scale * true, true / volume.expected_m, is_inside, off, off / found.scale_sigma)


def _scaled(T_world_camera: Array, scale: float) -> Array:
    return rigid.transform(T_world_camera[:3, :3], scale * T_world_camera[:3, 3])


def main():
    """Measure and print, or write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, help="folder of the recordings; without it, simulated people only")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=KINDS, help="tables to measure")
    parser.add_argument("--rigs", type=int, default=20, help="number of simulated rigs of each kind")
    add_write_option(parser)
    arguments = parser.parse_args()
    check_places(arguments.write, TABLES)
    if arguments.data is not None and "recordings" in arguments.only:
        measure_recordings(arguments.data, arguments.write)
    if arguments.data is not None and "silhouettes" in arguments.only:
        measure_silhouettes(arguments.data, arguments.write)
    if "simulated" in arguments.only:
        measure_simulated(arguments.rigs, arguments.write)
    if "several" in arguments.only:
        measure_several(arguments.data, arguments.write)
    if "alone" in arguments.only:
        measure_alone(arguments.write)
    if "simulated silhouettes" in arguments.only:
        measure_simulated_silhouettes(arguments.rigs, arguments.write)


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


def measure_silhouettes(data: Path, write: Sequence[Path]):
    """Write the table of silhouettes, after each row: one takes a minute of processor time."""
    conditions = Conditions(
        "`walk` (60 frames) and `fast_arms` (50) with exact masks, and `balance_real` (100) with silhouettes against "
        "its own median; four cameras each",
        "one person; only `fast_arms` has a stated height, 1.55 m",
        "nothing, or the lenses of the given calibration",
        "defaults",
        "bounds of the search of the first turns, and the crown on the axis, on `fast_arms`; `balance_real` and `walk` "
        "showed which errors were missing",
        COMMAND,
    )
    cells = {}
    for lenses in (False, True):
        for name, height_m in HEIGHTS_M.items():
            title = f"`{name}`, {LENS_NAMES[lenses]}"
            try:
                cells[title] = silhouette_row(data / name, height_m, lenses)
            except CalibrationError as error:
                cells[title] = [f"refused: {str(error).split(';')[0]}", *[""] * (len(HEADS) - 1)]
            show(write, TABLES[1], conditions, table(HEADS, cells, "recording"))


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
    show(write, TABLES[2], conditions, table(heads, cells, "cameras"))


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
    show(write, TABLES[3], conditions, table(heads, cells, "people"))


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
    show(write, TABLES[4], conditions, table(heads, cells, "scene"))


def measure_simulated_silhouettes(n_rigs: int, write: Sequence[Path]):
    """Write the table of simulated silhouettes, after each person: one takes two minutes of processor time."""
    exact, noisy, rim = SEGMENTATIONS
    kinds = [(n, True, s) for n in (4, 3, 2) for s in SEGMENTATIONS if n != 3 or s != rim]
    kinds += [(4, False, exact), (4, False, noisy), (3, False, exact), (2, False, exact)]
    results = {kind: list[Calibrated | None]() for kind in kinds}
    people = [*POPULATION][1:]
    for i in range(n_rigs):
        scene, person, seed = MOTIONS[i % len(MOTIONS)], people[(3 * i + 2) % len(people)], FIRST_FILMED_SEED + i
        found = filmed(person, scene, seed, 4, FILMED_FRAMES, [*SEGMENTATIONS.values()])
        films = dict(zip(SEGMENTATIONS, found, strict=True))
        for kind in kinds:
            results[kind].append(by_silhouettes(films[kind[2]], *kind[:2]))
            print(person, scene, kind, results[kind][-1], flush=True)
        cells = {
            f"{n} cameras, {LENS_NAMES[lenses]}, {masks}": _filmed_cells(results[n, lenses, masks])
            for n, lenses, masks in kinds
        }
        conditions = Conditions(
            f"{i + 1} simulated people of each kind, {FILMED_FRAMES} frames, walking round in a room with cameras in "
            "its corners, of seeds from 9200 on; 640x480 px, lenses that distort a little",
            "rendered people of several builds; their height is given",
            "nothing, or the true lenses",
            "defaults",
            "none on these; other people of seeds from 9100 on showed which errors were missing",
            COMMAND,
        )
        heads = ("refused", "true error, median, mm", "true / expected, median", "within 90%", "scale, %, median",
                 "scale, standard deviations, rms")  # fmt: skip
        show(write, TABLES[5], conditions, table(heads, cells, "cameras and masks"))


def _filmed_cells(results: Sequence[Calibrated | None]) -> list[str]:
    found = [r for r in results if r is not None]
    n_refused = f"{len(results) - len(found)}"
    if not found:
        return [n_refused, *["-"] * 5]
    true_mm, ratios, inside, scales, sigmas = (np.array(column) for column in zip(*found, strict=True))
    return [n_refused, f"{np.median(true_mm):.2f} (to {true_mm.max():.2f})",
            f"{np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f})", f"{np.mean(inside):.0%}",
            f"{100 * np.median(scales):+.1f} ({100 * scales.min():+.1f} to {100 * scales.max():+.1f})",
            f"{np.sqrt(np.mean(sigmas**2)):.1f}"]  # fmt: skip


if __name__ == "__main__":
    main()
