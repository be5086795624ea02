"""Compare the expected error of calibrations with the true one: `python tests/benchmarks/volume_error.py`.

Simulated rigs film a board (`tests/support/board_rigs.py`). Each is calibrated, and its 90% interval of the error in
the volume is compared with the true error. Rigs whose cameras share too few boards are refused and do not count.
"""

import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "support")]

from board_rigs import calibrated, in_first_camera, rms_error_m, simulated_rig
from doc_tables import Conditions, benchmark_parser, read_words, show, table

from tracker.errors import CalibrationError

TABLES = ("volume_error",)
FIRST_SEED = 1000
"""Seeds below were looked at while the method was made."""


def main():
    """Measure and print, or write the table."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--rigs", type=int, default=200, help="number of calibrated rigs")
    arguments = read_words(parser, TABLES)
    rows, refused, seed = [], 0, FIRST_SEED
    while len(rows) < arguments.rigs:
        rig, seed = simulated_rig(seed), seed + 1
        try:
            found = calibrated(rig).rig
        except CalibrationError:
            refused += 1
            continue
        true = rms_error_m(in_first_camera(rig.cameras), found.cameras, found.points_world)
        rows.append((len(rig.cameras), true, *found.volume))
        print(seed - 1, len(rig.cameras), *(f"{1000 * v:.2f}" for v in rows[-1][1:]), flush=True)
    cameras, true, expected, low, high = np.array(rows).T
    groups = {"all": cameras > 0} | {f"{n} cameras": cameras == n for n in range(2, 6)}
    cells = {
        name: [
            f"{chosen.sum()}",
            f"{np.mean((low <= true) & (true <= high), where=chosen):.0%}",
            f"{np.mean(true > high, where=chosen):.0%}",
            f"{np.mean(true < low, where=chosen):.0%}",
            f"{np.median((true / expected)[chosen]):.2f}",
            f"{1000 * np.median(true[chosen]):.2f}",
            f"{1000 * np.max(true[chosen]):.1f}",
        ]
        for name, chosen in groups.items()
    }
    conditions = Conditions(
        f"simulated corners of 60 frames: three boards, partly covered, 1% gross errors, noise of 0.1 to 0.6 px, other "
        f"lenses in each rig; {refused} more rigs were refused",
        "none",
        "nothing",
        "defaults",
        "none",
        "python tests/benchmarks/volume_error.py --write docs/log/calibration.md",
    )
    heads = ("rigs", "within 90%", "above", "below", "median true / expected", "median true, mm", "largest, mm")
    show(arguments.write, TABLES[0], conditions, table(heads, cells, "cameras"))


if __name__ == "__main__":
    main()
