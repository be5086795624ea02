"""`quadrille bench`: measure the tracker's speed and compare it with a baseline."""

import sys

from app.cli.arguments import OptionalPath
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter


def command(
    json: bool = False, baseline: OptionalPath = None, save: OptionalPath = None, tolerance: float = 0.4
) -> None:
    """Measure the tracker's speed on this machine and compare it with a baseline; status 1 if it became slower.

    Verdicts go by processor time, in units of a yardstick that is timed in turns. The clock shows what the load adds.

    Args:
        json: print one JSON object.
        baseline: file to compare with; the program's own by default.
        save: save the ratios in this file instead of comparing them.
        tolerance: with --save, the share by which a ratio may later be worse.
    """
    from rich.console import Console

    from app.bench import report as bench_report

    reference = (
        {"tolerance": tolerance, "ratios": {}}
        if save
        else bench_report.read_baseline(baseline or bench_report.BASELINE)
    )
    rows = []
    with Reporter(silent=json).over(bench_report.N_ROWS, "measuring") as tick:
        for row in bench_report.measure():
            rows.append(row)
            tick()
    if save:
        bench_report.save_baseline(rows, save, tolerance)
    found = bench_report.report(rows, reference)
    if json:
        print(format_json(found))
    else:
        # A file is as wide as the table; 80 columns are taken for a terminal that is not there.
        bench_report.show(found, Console(width=None if sys.stdout.isatty() else 1000))
    if found["slower"]:
        sys.exit(1)
