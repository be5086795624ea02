"""Write what the statuses are worth: the section of docs/accuracy.md, and the picture of the reliability."""

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from reliability_picture import Curve, reliability_svg
from sections import put_section
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

from tracker.geometry.arrays import Array
from tracker.tracking.confidence import LOST_ODDS, OFF_ODDS

DOCS = Path(__file__).resolve().parents[2] / "docs"
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
CONDITIONS = ("2 cameras", "3 cameras", "8 cameras", "half the frame rate", "no backgrounds")
BODIES = ("generic", "acquired")


def write_results(runs: Sequence[Run], outside: Sequence[Run]) -> None:
    """Print the weights, and write the section and the picture.

    Args:
        runs: of the simulated recordings, to which the weights are fitted.
        outside: of recordings to which nothing is fitted.
    """
    weights = fitted(runs)
    of_frame = fitted(runs, features=lambda rows: rows.frame_features)
    print("at the end of a run: weights, constants of off and lost:", np.round(weights, 3).tolist())
    print("while it goes on:", np.round(of_frame, 3).tolist())
    odds = held_out_odds(runs)
    found = [statuses(r.rows, o) for r, o in zip(runs, odds, strict=True)]
    lines = [
        "## Statuses",
        "",
        "Each frame has a status: good, doubtful or lost (`python tests/benchmarks/calibrate_status.py`). A frame is "
        "lost when a limb joint is off by more than 150 mm, off when by more than 100 mm, and fine when not off. "
        "Statuses are those of a finished run. Rows of simulated people are by weights fitted to all other people, "
        "those of recordings by weights fitted to all simulated people. Each cell: lost frames that are flagged "
        "(doubtful or lost) / good frames that are off / flagged frames that are fine.",
        "",
        "A limb is doubtful where it is off with a probability above 5%, and lost where it is lost with one above 25%: "
        "to call a wrong pose good is the worse error. The goals are 95% of the lost frames flagged, 5% of the good "
        "frames off, 40% of the flagged frames fine.",
        "",
        *_table(runs, found, [(r, statuses(r.rows, odds_by(weights, r.rows.features))) for r in outside]),
        "",
        "![Share of limbs that were off or lost, by the probability that the tracker gave](images/reliability.svg)",
        "",
        *_reliability_table(runs, odds),
        "",
        "The list of doubts begins with the likeliest. Share of frames that are off, among the first of all frames in "
        "the order of the probability:",
        "",
        *_ranking_table(runs, found),
        "",
        "The best threshold for each group, chosen in hindsight: the least share of flagged frames that are fine while "
        "the other two goals hold, and the share of all frames that are then flagged. *Error known*: the same if "
        "frames were ranked by their largest true error, known with a standard deviation of 20 mm.",
        "",
        *_attainable_table(runs, found),
        "",
        "Each threshold on the probability that a limb is off, with four cameras and backgrounds. 5% is the largest of "
        "them that meets the first two goals with both bodies:",
        "",
        *_threshold_table(runs, odds),
        "",
        "What is called lost by each threshold, and frames in which a limb flew off (a joint is off by more than 250 "
        "mm). At 25% at least half of the frames that are called lost are off everywhere:",
        "",
        *_lost_table(runs, odds),
    ]
    put_section(DOCS / "accuracy.md", "\n".join(lines) + "\n")
    (DOCS / "images" / "reliability.svg").write_text(reliability_svg(_curves(runs, odds)), "utf-8")


def _table(runs: Sequence[Run], found: Sequence[Statuses], outside: Sequence[tuple[Run, Statuses]]) -> list[str]:
    """Return the rows of Markdown: of the simulated recordings, and of those outside."""
    lines = ["| recordings | frames | generic body | frames | acquired body |", "|---|---|---|---|---|"]
    simulated = list(zip(runs, found, strict=True))
    alone = sorted({r.bodies[0] for r in runs if len(r.bodies) == 1})
    for body in alone:
        lines.append(_row(body.replace("_", " "), simulated, lambda r, b=body: r.bodies == (b,) and not r.condition))
    for name in sorted({r.recording for r in runs if len(r.bodies) > 1}):
        lines.append(_row(name.replace("_", " "), simulated, lambda r, n=name: r.recording == n and not r.condition))
    for condition in CONDITIONS:
        for several in (False, True):
            title = f"{condition}, {'several people' if several else 'one person'}"
            if any(r.condition == condition and (len(r.bodies) > 1) == several for r in runs):
                lines.append(_row(title, simulated, _of(condition, several)))
    lines.append(_row("**all with 4 cameras and backgrounds**", simulated, lambda r: not r.condition))
    for name in dict.fromkeys(r.recording for r, _ in outside):
        people = next(len(r.bodies) for r, _ in outside if r.recording == name)
        for person in range(people):
            title = f"`{name}`" + (f", person {person + 1}" if people > 1 else "")
            lines.append(_row(title, outside, lambda r, n=name: r.recording == n, person))
    if outside:
        lines.append(_row("**all recordings**", outside, lambda _: True))
    return lines


def _of(condition: str, several: bool) -> Callable[[Run], bool]:
    return lambda r: r.condition == condition and (len(r.bodies) > 1) == several


def _row(
    title: str, found: Sequence[tuple[Run, Statuses]], keep: Callable[[Run], bool], person: int | None = None
) -> str:
    """Return a row of Markdown: of runs that are kept, with both bodies; of one person or of all."""
    cells = [title]
    for body in BODIES:
        own = [s for r, s in found if r.searched and r.body == body and keep(r)]
        counts = summed(s.counts(None if person is None else s.person == person) for s in own)
        cells += [str(counts.frames), _cell(counts)]
    return f"| {' | '.join(cells)} |"


def _cell(c: Counts) -> str:
    return f"{_share(c.lost_flagged, c.lost)} / {_share(c.good_off, c.good)} / {_share(c.flagged_fine, c.flagged)}"


def _share(part: int, whole: int) -> str:
    """Return a share with its numbers, as in "95% (19 of 20)"."""
    return f"{part / whole:.0%} ({part} of {whole})" if whole else "none"


def _reliability_table(runs: Sequence[Run], odds: Sequence[Array]) -> list[str]:
    """Return the rows of Markdown."""
    lines = ["| probability given to a limb | off by more than 100 mm | off by more than 150 mm |", "|---|---|---|"]
    columns = []
    for curve in _curves(runs, odds):
        columns.append(dict(zip(curve.bins, curve.points, strict=True)))
    for low, high in itertools.pairwise(EDGES):
        cells = [_reliability_cell(column.get((low, high))) for column in columns]
        lines.append(f"| {low:.0%} to {high:.0%} | {' | '.join(cells)} |")
    return lines


def _ranking_table(runs: Sequence[Run], found: Sequence[Statuses]) -> list[str]:
    """Return the rows of Markdown."""
    groups: dict[str, Callable[[Run], bool]] = {
        "4 cameras, one person": lambda r: not r.condition and len(r.bodies) == 1,
        "4 cameras, several people": lambda r: not r.condition and len(r.bodies) > 1,
        "half the frame rate": lambda r: r.condition == "half the frame rate",
    }
    lines = [f"| recordings | {' | '.join(f'first {s:.0%}' for s in FIRST)} |", "|---" * (1 + len(FIRST)) + "|"]
    for title, keep in groups.items():
        own = [s for r, s in zip(runs, found, strict=True) if r.searched and keep(r)]
        lines.append(f"| {title} | {' | '.join(f'{x:.0%}' for x in first_off(own, FIRST))} |")
    return lines


def _attainable_table(runs: Sequence[Run], found: Sequence[Statuses]) -> list[str]:
    """Return the rows of Markdown."""
    heads = ("generic body", "error known", "acquired body", "error known")
    lines = [f"| recordings | {' | '.join(f'{h}: fine, flagged' for h in heads)} |", "|---" * 5 + "|"]
    rng = np.random.default_rng(1)
    groups: dict[str, Callable[[Run], bool]] = {
        f"4 cameras, {title}": lambda r, s=several: not r.condition and (len(r.bodies) > 1) == s
        for title, several in (("one person", False), ("several people", True))
    }
    groups |= {c: lambda r, c=c: r.condition == c for c in CONDITIONS}
    for title, keep in groups.items():
        cells = []
        for body in BODIES:
            own = [s for r, s in zip(runs, found, strict=True) if r.searched and r.body == body and keep(r)]
            known = [s._replace(odds=s.worst_mm + rng.normal(0.0, KNOWN_MM, len(s.worst_mm))) for s in own]
            cells += [f"{fine:.0%}, {flagged:.0%}" for fine, flagged in map(least_fine, (own, known))]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return lines


def _threshold_table(runs: Sequence[Run], odds: Sequence[Array]) -> list[str]:
    """Return the rows of Markdown: what thresholds of the probabilities cost."""
    lines = ["| doubtful from | generic body | flagged | acquired body | flagged |", "|---" * 5 + "|"]
    for probability in THRESHOLDS:
        cells = [f"{probability:.0%}"]
        for body in BODIES:
            used = [
                (r, o) for r, o in zip(runs, odds, strict=True) if r.searched and r.body == body and not r.condition
            ]
            shift = np.array([_shift(OFF_ODDS, probability), 0.0])
            counts = summed(statuses(r.rows, o + shift).counts() for r, o in used)
            cells += [_cell(counts), f"{counts.flagged / counts.frames:.0%}"]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _lost_table(runs: Sequence[Run], odds: Sequence[Array]) -> list[str]:
    """Return the rows of Markdown."""
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
    return lines


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
