"""The report of `quadrille bench`: the tracker's speed beside its requirements, and whether it has become slower.

Times depend on the machine. Requirements therefore bound their ratio to a yardstick that is timed in the same run. The
ratios are compared with those of a baseline that is part of the program. Both are in processor time, which other
programs hardly change; time by the clock and the load of the machine stand beside it.
"""

import json
import os
import platform
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import msgspec
from rich.console import Console
from rich.table import Table

from app.bench import acquisition_rows, calibration_rows, contour_rows, diagnosis_rows, run_rows, start_rows, voxel_rows
from app.bench import rows as bench_rows
from app.bench.rows import Row, Yardstick
from app.bench.sample_frames import FRAME, read_crowd, read_frame
from app.session.samples import sample_copy
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.formats.text_files import TextKind, read_json
from tracker.session.assemble import DEFAULT_MODEL
from tracker.simulate import Simulation, simulate
from tracker.validation import Number, check

BASELINE = Path(__file__).with_name("baseline.json")
N_ROWS = 34
"""Number of rows that `measure` yields if `cma` is installed."""
_KIND = TextKind("baseline", 1_000_000, TrackerError, "make one with --save")
_PACKAGES = ("numpy", "opencv-python-headless", "numba", "scipy", "av", "cma")


class _Baseline(msgspec.Struct):
    """Ratios to the yardstick that rows had."""

    tolerance: Number
    ratios: dict[str, Number]


def measure() -> Iterator[Row]:
    """Measure all rows, one after the other, OpenCV on one thread."""
    yardstick = Yardstick()
    frame = read_frame(sample_copy("elbow_rotation"))
    cones = frame.with_model("gavrila22_cones")
    with TemporaryDirectory() as folder, _one_thread():
        simulate(Path(folder) / "six", Simulation("exercise", n_cameras=6, n_frames=2))
        six_views = read_frame(Path(folder) / "six")
        six, six_of_54 = (six_views.with_model(name) for name in ("gavrila22_cones", "knossow54"))
        yield from bench_rows.candidates(frame, cones, yardstick)
        yield from bench_rows.searches(frame, cones, yardstick)
        yield from bench_rows.iterations(cones, six, yardstick)
        yield contour_rows.iteration(six_of_54, yardstick)
        yield from contour_rows.solves(six_of_54, yardstick)
        yield from bench_rows.evolution(cones, yardstick)
        simulate(Path(folder) / "crowd", Simulation("crowd_of_three", n_frames=2))
        yield from bench_rows.crowds(read_crowd(Path(folder) / "crowd", 0), yardstick)
    with _one_thread():
        yield from calibration_rows.adjustment(yardstick)
        yield from diagnosis_rows.diagnoses(frame.with_model(DEFAULT_MODEL), yardstick)
    yield voxel_rows.voxel_frame(frame, yardstick)
    yield bench_rows.pipeline(frame, yardstick)
    yield from contour_rows.pipelines(frame.with_model("gavrila34"), yardstick)
    yield bench_rows.pipeline_of_two(read_crowd(sample_copy("tango"), FRAME), yardstick)
    yield from acquisition_rows.acquisitions(frame, yardstick)
    yield run_rows.whole_run(frame.with_model(DEFAULT_MODEL), yardstick)
    yield from start_rows.first_start(yardstick)


@contextmanager
def _one_thread() -> Generator[None, None, None]:
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def read_baseline(path: Path = BASELINE) -> dict[str, Any]:
    """Read a baseline: `tolerance`, and `ratios` of rows by name.

    Raises:
        TrackerError: the file is not a baseline.
    """
    baseline: _Baseline = check(read_json(path, _KIND), _Baseline, f"baseline {path}", TrackerError)
    return msgspec.structs.asdict(baseline)


def save_baseline(rows: list[Row], path: Path, tolerance: float) -> None:
    """Save the ratios of rows as a baseline."""
    ratios = {r.name: round(r.ratio, 5) for r in rows}
    write_text_atomic(path, json.dumps({"tolerance": tolerance, "ratios": ratios}, indent=2) + "\n")


def report(rows: list[Row], baseline: Mapping[str, Any]) -> dict[str, Any]:
    """Compare rows with their requirements and the baseline.

    Returns:
        `versions`, `load` (mean number of running programs of the last 1, 5 and 15 minutes; None where the system does
        not say) and `cores` of the machine, `tolerance`, `rows` and the names of those that became `slower` than the
        tolerance allows.
    """
    ratios, tolerance = baseline["ratios"], baseline["tolerance"]
    compared = []
    for r in rows:
        before = ratios.get(r.name)
        compared.append(
            {
                "name": r.name,
                "what": r.what,
                "processor_us": r.time_us,
                "clock_us": r.clock_us,
                "busy_cores": r.busy_cores,
                "yardstick_us": r.yardstick_us,
                "ratio": r.ratio,
                "must": r.must,
                "aim": r.aim,
                "holds": None if r.must is None else r.ratio <= r.must,
                "baseline": before,
                "slower": before is not None and r.ratio > before * (1 + tolerance),
                "note": r.note,
            }
        )
    return {
        "versions": versions(),
        "load": os.getloadavg() if hasattr(os, "getloadavg") else None,
        "cores": os.cpu_count(),
        "tolerance": tolerance,
        "rows": compared,
        "slower": [t["name"] for t in compared if t["slower"]],
    }


def versions() -> dict[str, str]:
    """Return the versions of the software that the times depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "none"
    return found


def show(found: Mapping[str, Any], console: Console) -> None:
    """Print a report as a table. Ratios are given as at least 1: the time in yardsticks, or the reverse.

    A console that is too narrow for all columns gets those of the verdict.
    """
    table = _table(found, ("work", "processor", "clock", "cores", "yardsticks", "must", "aim", "baseline", ""))
    unbounded = console.options.update(max_width=1000)
    if console.measure(table, options=unbounded).maximum > console.width:
        table = _table(found, ("work", "processor", "yardsticks", "must", ""))
    console.print(table)
    if found["load"] is not None:
        loads = ", ".join(f"{load:.1f}" for load in found["load"])
        console.print(f"load of the {found['cores']} cores in the last 1, 5 and 15 minutes: {loads}", highlight=False)
    console.print(", ".join(f"{k} {v}" for k, v in found["versions"].items()), highlight=False)
    if found["slower"]:
        by = f"{100 * found['tolerance']:.0f}%"
        console.print(f"slower than the baseline by more than {by}: {', '.join(found['slower'])}", style="bold red")


def _table(found: Mapping[str, Any], columns: Sequence[str]) -> Table:
    table = Table(*columns, box=None)
    for r in found["rows"]:
        verdict = "slower" if r["slower"] else "" if r["holds"] is None else "holds" if r["holds"] else "fails"
        cells = {
            "work": r["what"], "processor": _time(r["processor_us"]), "clock": _time(r["clock_us"]),
            "cores": f"{r['busy_cores']:.1f}", "yardsticks": _ratio(r["ratio"]),
            **{name: _ratio(r[name]) for name in ("must", "aim", "baseline")}, "": f"{verdict} {r['note']}".strip(),
        }  # fmt: skip
        table.add_row(*(cells[column] for column in columns))
    return table


def _ratio(ratio: float | None) -> str:
    return "" if ratio is None else f"/ {1 / ratio:.1f}" if ratio < 1 else f"x {ratio:.1f}"


def _time(us: float) -> str:
    return f"{us:.0f} us" if us < 2000 else f"{us / 1000:.1f} ms"
