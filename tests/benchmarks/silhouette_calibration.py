"""Calibrate cameras by silhouettes and compare: `python tests/benchmarks/silhouette_calibration.py --data DIR`.

`walk` and `fast_arms` have exact masks; silhouettes of `balance_real` are those of the footage against its own median.
Cameras of recordings are compared with the given ones as in `person_calibration.py`, by key points. Simulated people
are rendered masks with the errors of a segmentation (`tests/support/filmed_silhouettes.py`).
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from doc_tables import Conditions, show, table
from filmed_people import aligned, blanks
from filmed_silhouettes import EXACT, FilmedSilhouettes, Segmentation, filmed
from person_calibration import HEADS, HEIGHTS_M, LENS_NAMES, read_arguments, recording_row, reprojected

from tracker.calibration.self_calibration.person_files import FilmedPerson, calibrate_filmed_person
from tracker.calibration.self_calibration.silhouette_calibration import calibrate_by_silhouettes
from tracker.compute.progress import unreported
from tracker.errors import CalibrationError
from tracker.simulate.people.population import POPULATION

TABLES = ("silhouette_calibration recordings", "silhouette_calibration simulated")
KINDS = ("recordings", "simulated")
MASKS = {"walk": "masks", "fast_arms": "masks", "balance_real": None}
"""Folder of masks; None where the footage shows silhouettes."""
FIRST_FILMED_SEED = 9200
SEGMENTATIONS = {
    "exact": EXACT,
    "borders with noise of 1 px, 3 holes": Segmentation(noise_px=1.0, holes=3),
    "a rim of 1 px": Segmentation(dilation_px=1.0),
}
MOTIONS = ("exercise", "dance", "reach_and_cross", "walk_in_place")
FILMED_FRAMES = 24
COMMAND = "python tests/benchmarks/silhouette_calibration.py --data DIR --write docs/log/calibration.md"


def silhouette_row(folder: Path, height_m: float | None, has_lenses: bool) -> list[str]:
    """Calibrate the cameras of a recording by silhouettes, and return a row of the table."""
    masks = MASKS[folder.name]
    paths = {p.stem: p for p in sorted(folder.glob("*.mp4"))}
    lenses = folder / "Calib.toml" if has_lenses else None
    filmed = FilmedPerson(folder / masks if masks else None, [*paths.values()], stature_m=height_m, lenses=lenses)
    return recording_row(folder, calibrate_filmed_person(filmed, unreported), height_m, has_lenses)


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
        calibration = calibrate_by_silhouettes(rows, lenses, film.height_m, has_lenses)
    except CalibrationError as error:
        print(str(error).split(";")[0], flush=True)
        return None
    points = film.joints_world.reshape(-1, 3)[::5]
    joints, known = reprojected(cameras, calibration.cameras, points)
    scale, R, t = aligned(joints[known], points[known])
    errors = np.linalg.norm(scale * joints[known] @ R.T + t - points[known], axis=1)
    true, volume = float(np.sqrt(np.mean(errors**2))) / scale, calibration.volume
    off = 1 / scale - 1
    is_inside = bool(volume.low_m <= true <= volume.high_m)
    return Calibrated(1000 * scale * true, true / volume.expected_m, is_inside, off, off / calibration.scale_sigma)


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
            show(write, TABLES[0], conditions, table(HEADS, cells, "recording"))


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
        show(write, TABLES[1], conditions, table(heads, cells, "cameras and masks"))


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


def main():
    """Measure and print, or write the tables."""
    arguments = read_arguments(__doc__, KINDS, TABLES)
    if arguments.data is not None and "recordings" in arguments.only:
        measure_silhouettes(arguments.data, arguments.write)
    if "simulated" in arguments.only:
        measure_simulated_silhouettes(arguments.rigs, arguments.write)


if __name__ == "__main__":
    main()
