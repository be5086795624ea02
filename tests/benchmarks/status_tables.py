"""Show what the statuses of `calibrate_status.py` are worth: its tables, and the picture of the reliability."""

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from doc_tables import Conditions, show, table
from numpy.typing import NDArray
from reliability_picture import Curve, reliability_svg
from status_model import (
    LOST_MM,
    OFF_MM,
    Counts,
    Run,
    Statuses,
    first_off,
    fitted,
    held_out_odds,
    least_fine,
    odds_by,
    pooled,
    reliability,
    statuses,
    summed,
)

from tracker.estimation.tracking.confidence import LOST_ODDS, OFF_ODDS
from tracker.geometry.arrays import Array

CONDITIONS = Conditions(
    footage="simulated people of ten builds, couples and a crowd, with clutter and noise, and the recordings; four "
    "cameras with backgrounds at the full frame rate, unless the row says otherwise",
    body="`gavrila34`: generic, of the height that the joints give, and acquired from another recording of the person",
    start="pose fitted to the true joints of frame 0",
    settings="first passes. The statuses of a simulated person are by weights fitted to all other people, "
    "those of recordings by weights fitted to all simulated people",
    chosen="both thresholds (simulated people), rules of tracking (recordings)",
    command="python tests/benchmarks/calibrate_status.py --data DIR --write docs/log/accuracy.md "
    "docs/measurements.md docs/decisions/tracking.md",
)
COUNTS = ("frames", "lost, flagged", "good, yet off", "flagged", "flagged, yet fine")
EDGES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
"""Bounds of the groups of limbs whose probabilities are compared with what happened."""
FIRST = (0.01, 0.02, 0.05, 0.1, 1.0)
"""Shares of all frames, the likeliest off first."""
THRESHOLDS = (0.03, 0.05, 0.07, 0.1, 0.15)
"""Probabilities above which a limb might be called doubtful."""
LOST_THRESHOLDS = (0.15, 0.25, 0.5)
"""Probabilities above which a limb might be called lost."""
KNOWN_MM = 20.0
"""Standard deviation with which the largest error of a frame would have to be known, mm."""
FLEW_MM = 250.0
"""A limb flew off where a joint is off by more."""
CONDITIONS_TRIED = ("2 cameras", "3 cameras", "8 cameras", "half the frame rate", "no backgrounds")
BODIES = ("generic", "acquired")
Judged = tuple[Run, Statuses]
"""A run and the statuses of its frames."""


def write_results(runs: Sequence[Run], outside: Sequence[Run], write: Sequence[Path]) -> None:
    """Print the weights and the tables, and write the tables and the picture.

    Args:
        runs: of the simulated recordings, to which the weights are fitted.
        outside: of recordings to which nothing is fitted.
        write: documents whose tables are replaced; the picture lies beside them.
    """
    weights = fitted(runs)
    print("weights, constants of off and lost:", np.round(weights, 3).tolist())
    odds = held_out_odds(runs)
    found = [statuses(r.rows, o) for r, o in zip(runs, odds, strict=True)]
    simulated = list(zip(runs, found, strict=True))
    recorded = [(r, statuses(r.rows, odds_by(weights, r.rows.features))) for r in outside]
    for part, lines in {
        "groups": _groups_table(simulated, recorded),
        "people": _people_table(simulated, recorded),
        "reliability": _reliability_table(runs, odds),
        "ranking": _ranking_table(runs, found),
        "attainable": _attainable_table(runs, found),
        "thresholds": _threshold_table(runs, odds),
        "called lost": _lost_table(runs, odds),
    }.items():
        show(write, f"calibrate_status {part}", CONDITIONS, lines, is_repeated=part not in ("groups", "ranking"))
    for path in write:
        (path.parent / "images" / "reliability.svg").write_text(reliability_svg(_curves(runs, odds)), "utf-8")


def _groups_table(simulated: Sequence[Judged], recorded: Sequence[Judged]) -> str:
    """Return the sums of each condition with each body."""
    keeps = {
        f"4 cameras, {title}": lambda r, s=several: not r.condition and (len(r.bodies) > 1) == s
        for title, several in (("one person", False), ("several people", True))
    }
    keeps |= {
        f"{c}, {title}": _of(c, several)
        for c in CONDITIONS_TRIED
        for title, several in (("one person", False), ("several people", True))
    }
    rows = {}
    for body in BODIES:
        for title, keep in keeps.items():
            if any(keep(r) for r, _ in simulated):
                rows[f"{body}: {title}"] = _sums(simulated, body, keep)
        if recorded:
            rows[f"{body}: recordings"] = _sums(recorded, body, lambda _: True)
    return table(COUNTS, rows, "body and footage")


def _people_table(simulated: Sequence[Judged], recorded: Sequence[Judged]) -> str:
    """Return what each person, couple and recording reaches with four cameras and backgrounds, with both bodies."""
    rows = {}
    for body in sorted({r.bodies[0] for r, _ in simulated if len(r.bodies) == 1}):
        rows[body.replace("_", " ")] = _both(simulated, lambda r, b=body: r.bodies == (b,) and not r.condition)
    for name in sorted({r.recording for r, _ in simulated if len(r.bodies) > 1}):
        rows[name.replace("_", " ")] = _both(simulated, lambda r, n=name: r.recording == n and not r.condition)
    for name in dict.fromkeys(r.recording for r, _ in recorded):
        people = next(len(r.bodies) for r, _ in recorded if r.recording == name)
        for person in range(people):
            title = f"`{name}`" + (f", person {person + 1}" if people > 1 else "")
            rows[title] = _both(recorded, lambda r, n=name: r.recording == n, person if people > 1 else None)
    heads = [f"{body}: {count}" for body in BODIES for count in ("good, yet off", "flagged, yet fine")]
    return table(heads, rows, "footage")


def _both(found: Sequence[Judged], keep: Callable[[Run], bool], person: int | None = None) -> list[str]:
    """Return the shares of good frames that are off and of flagged frames that are fine, with each body."""
    cells = []
    for body in BODIES:
        c = _counts(found, body, keep, person)
        cells += [_of_all(c.good_off, c.good), _of_all(c.flagged_fine, c.flagged)]
    return cells


def _sums(found: Sequence[Judged], body: str, keep: Callable[[Run], bool]) -> list[str]:
    """Return the cells of `COUNTS`."""
    c = _counts(found, body, keep)
    flagged = f"{c.flagged / c.frames:.0%}"
    shares = _share(c.lost_flagged, c.lost), _share(c.good_off, c.good), flagged, _share(c.flagged_fine, c.flagged)
    return [str(c.frames), *shares]


def _counts(found: Sequence[Judged], body: str, keep: Callable[[Run], bool], person: int | None = None) -> Counts:
    """Count the frames of the runs that are kept, of one person or of all; limbs were searched."""
    own = [s for r, s in found if r.searched and r.body == body and keep(r)]
    return summed(s.counts(None if person is None else s.person == person) for s in own)


def _of_all(part: int, whole: int) -> str:
    return f"{part} of {whole}" if whole else "none"


def _of(condition: str, several: bool) -> Callable[[Run], bool]:
    return lambda r: r.condition == condition and (len(r.bodies) > 1) == several


def _cell(c: Counts) -> str:
    return f"{_share(c.lost_flagged, c.lost)} / {_share(c.good_off, c.good)} / {_share(c.flagged_fine, c.flagged)}"


def _share(part: int, whole: int) -> str:
    """Return a share with its numbers, as in "95% (19 of 20)"."""
    return f"{part / whole:.0%} ({part} of {whole})" if whole else "none"


def _reliability_table(runs: Sequence[Run], odds: Sequence[Array]) -> str:
    """Return the table in Markdown."""
    columns = [dict(zip(curve.bins, curve.points, strict=True)) for curve in _curves(runs, odds)]
    rows = {
        f"{low:.0%} to {high:.0%}": [_reliability_cell(column.get((low, high))) for column in columns]
        for low, high in itertools.pairwise(EDGES)
    }
    return table(("off by more than 100 mm", "off by more than 150 mm"), rows, "probability given to a limb")


def _ranking_table(runs: Sequence[Run], found: Sequence[Statuses]) -> str:
    """Return the table in Markdown."""
    groups: dict[str, Callable[[Run], bool]] = {
        "4 cameras, one person": lambda r: not r.condition and len(r.bodies) == 1,
        "4 cameras, several people": lambda r: not r.condition and len(r.bodies) > 1,
        "half the frame rate": lambda r: r.condition == "half the frame rate",
    }
    rows = {}
    for title, keep in groups.items():
        own = [s for r, s in zip(runs, found, strict=True) if r.searched and keep(r)]
        rows[title] = [f"{x:.0%}" for x in first_off(own, FIRST)]
    return table([f"first {s:.0%}" for s in FIRST], rows, "recordings")


def _attainable_table(runs: Sequence[Run], found: Sequence[Statuses]) -> str:
    """Return the table in Markdown."""
    heads = ("generic body", "error known", "acquired body", "error known")
    rows, rng = {}, np.random.default_rng(1)
    groups: dict[str, Callable[[Run], bool]] = {
        f"4 cameras, {title}": lambda r, s=several: not r.condition and (len(r.bodies) > 1) == s
        for title, several in (("one person", False), ("several people", True))
    }
    groups |= {c: lambda r, c=c: r.condition == c for c in CONDITIONS_TRIED}
    for title, keep in groups.items():
        cells = []
        for body in BODIES:
            own = [s for r, s in zip(runs, found, strict=True) if r.searched and r.body == body and keep(r)]
            known = [s._replace(odds=s.worst_mm + rng.normal(0.0, KNOWN_MM, len(s.worst_mm))) for s in own]
            cells += [f"{fine:.0%}, {flagged:.0%}" for fine, flagged in map(least_fine, (own, known))]
        rows[title] = cells
    return table([f"{h}: fine, flagged" for h in heads], rows, "recordings")


def _threshold_table(runs: Sequence[Run], odds: Sequence[Array]) -> str:
    """Return the table in Markdown: what thresholds of the probabilities cost."""
    rows = {}
    for probability in THRESHOLDS:
        cells = []
        for body in BODIES:
            used = [
                (r, o) for r, o in zip(runs, odds, strict=True) if r.searched and r.body == body and not r.condition
            ]
            shift = np.array([_shift(OFF_ODDS, probability), 0.0])
            counts = summed(statuses(r.rows, o + shift).counts() for r, o in used)
            cells += [_cell(counts), f"{counts.flagged / counts.frames:.0%}"]
        rows[f"{probability:.0%}"] = cells
    return table(("generic body", "flagged", "acquired body", "flagged"), rows, "doubtful from")


def _lost_table(runs: Sequence[Run], odds: Sequence[Array]) -> str:
    """Return the table in Markdown."""
    groups: dict[str, Callable[[Run], bool]] = {
        "4 cameras": lambda r: r.searched and not r.condition,
        "2 cameras": lambda r: r.condition == "2 cameras",
        "half the frame rate": lambda r: r.condition == "half the frame rate",
        "4 cameras, limbs not searched": lambda r: not r.searched,
    }
    heads = ("recordings", "lost from", "called lost", "of them off", "flew off, called lost", "flew off, flagged")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for (title, keep), probability in itertools.product(groups.items(), LOST_THRESHOLDS):
        shift = np.array([0.0, _shift(LOST_ODDS, probability)])
        own = [statuses(r.rows, o + shift) for r, o in zip(runs, odds, strict=True) if keep(r)]
        status, worst = (np.concatenate([getattr(s, name) for s in own]) for name in ("status", "worst_mm"))
        lost, flew = status == "lost", worst > FLEW_MM
        cells = [
            f"{probability:.0%}", str(lost.sum()), _share(int((lost & (worst > OFF_MM)).sum()), int(lost.sum())),
            _share(int((lost & flew).sum()), int(flew.sum())),
            _share(int((flew & (status != "good")).sum()), int(flew.sum())),
        ]  # fmt: skip
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _shift(threshold_odds: float, probability: float) -> float:
    """Return what to add to log odds so that a fixed threshold acts as one at another probability."""
    return threshold_odds - float(np.log(probability / (1.0 - probability)))


def _reliability_cell(point: tuple[float, float, int] | None) -> str:
    return "" if point is None else f"{point[1]:.1%} of {point[2]}"


def _curves(runs: Sequence[Run], odds: Sequence[Array]) -> list[Curve]:
    """Return the reliability at both thresholds, of limbs that were tracked as the tracker does."""
    probabilities, errors_mm = pooled(runs, odds, lambda r: r.searched)
    out = []
    for i, (name, limit_mm) in enumerate((("off by more than 100 mm", OFF_MM), ("off by more than 150 mm", LOST_MM))):
        happened: NDArray[np.bool_] = errors_mm > limit_mm
        points = [
            ((low, high), reliability(probabilities[:, i], happened, (low, high)))
            for low, high in itertools.pairwise(EDGES)
        ]
        known = [(span, found[0]) for span, found in points if found]
        out.append(Curve(name, [span for span, _ in known], [point for _, point in known]))
    return out
