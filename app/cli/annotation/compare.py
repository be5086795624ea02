"""`quadrille compare`: say how far the copies of a session differ that several annotators made."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from app.cli.arguments import OptionalName, OptionalNumber, OptionalPath
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.evaluation.agreement.comparison import Agreement
    from tracker.evaluation.agreement.copies import Copies
    from tracker.evaluation.agreement.statistics import Icc

_LISTED = 10
"""Number of frames in the list of the largest differences; `--json` has all."""


@dataclass(frozen=True)
class CompareArguments:
    """Arguments of `quadrille compare`."""

    sessions: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="A B [C ...]", help_behavior_hint="")
    ]
    """copies of one session, each with the work of one annotator, or of one annotator at different times."""
    poses: Annotated[Literal["keyframes", "all"], tyro.conf.arg(metavar="keyframes|all")] = "keyframes"
    """poses that a person set or verified, or tracked ones too."""
    person: OptionalName = None
    """name; all people by default."""
    tolerance: OptionalNumber = None
    """distance of a joint in millimetres above which a frame is listed; without it, all frames are, the worst first."""
    csv: OptionalPath = None
    """file to write: the table of joints and angles."""
    report: OptionalPath = None
    """HTML file to write: plots, tables and the worst frames."""
    consensus: OptionalPath = None
    """TRC file to write: the mean joints of all copies, of one person."""
    overwrite: bool = False
    """replace the files of --csv, --report and --consensus."""
    json: bool = False
    """print one JSON object; docs/log/annotation.md lists its keys."""


def command(arguments: Annotated[CompareArguments, tyro.conf.arg(name="")]) -> None:
    """Say how far annotators of one session differ: bias, limits of agreement, ICC and typical error.

    Frames in which each copy has a pose are compared, joint by joint and angle by angle. Differences are the second
    copy less the first.
    """
    from app.export.agreement_report import write_report
    from app.export.agreement_table import agreement_record, pairs_of, write_consensus, write_table
    from tracker.evaluation.agreement.comparison import compare

    files = {"--csv": arguments.csv, "--report": arguments.report, "--consensus": arguments.consensus}
    for option, path in files.items():
        if path is not None and path.exists() and not arguments.overwrite:
            raise TrackerError(f"expected {option} at a path that is free, found {path}; say --overwrite to replace it")
    tolerance_m = _tolerance_m(arguments.tolerance)
    copies = _read(arguments)
    people = dict.fromkeys(s.person for s in copies.subjects)
    if arguments.consensus is not None and len(people) > 1:
        raise TrackerError(f"expected one person with --consensus, found {', '.join(people)}; say --person NAME")
    found = compare(copies)
    if arguments.csv is not None:
        write_table(copies, arguments.csv)
    if arguments.report is not None:
        write_report(copies, found, tolerance_m, arguments.report)
    if arguments.consensus is not None:
        write_consensus(copies, arguments.consensus)
    if arguments.json:
        print(format_json(agreement_record(copies, found, pairs_of(copies), arguments.poses, tolerance_m)))
        return
    print(_format(copies, found, tolerance_m))
    for path in files.values():
        if path is not None:
            print(f"wrote {path}")


def _tolerance_m(millimetres: float | None) -> float | None:
    """Return the tolerance in metres.

    Raises:
        TrackerError: it is no number from 0.
    """
    if millimetres is None:
        return None
    if not 0 <= millimetres < float("inf"):
        raise TrackerError(f"expected --tolerance as millimetres from 0, found {millimetres:g}; 30 means 3 cm")
    return millimetres / 1000


def _read(arguments: CompareArguments) -> "Copies":
    from app.cli.target import load_target
    from tracker.evaluation.agreement.copies import read_copies

    folders = arguments.sessions
    if len(folders) < 2:
        raise TrackerError(f"expected at least two sessions to compare, found {len(folders)}; name both copies")
    targets = [load_target(folder, arguments.person, several=True) for folder in folders]
    first = targets[0]
    people = None if arguments.person is None else [first.session.people[i].name for i in first.people]
    return read_copies([t.session for t in targets], arguments.poses, people)


def _format(copies: "Copies", found: "Agreement", tolerance_m: float | None) -> str:
    two = len(copies.names) == 2
    order = "; differences: second less first" if two else ""
    lines = [f"{len(copies.subjects)} poses by {', '.join(copies.names)}{order}"]
    lines.append(f"  {'':23}   bias       limits  typical error      ICC(A,1), interval")
    for name, joint in found.joints.items():
        figures = [1000 * x for x in (joint.along.bias, joint.along.lower, joint.along.upper, joint.typical_error_m)]
        lines.append(f"{_row(name, figures, 'mm')}{_icc(joint.icc)}{_pair(joint.pair, two)}")
    for name, angle in found.angles.items():
        limits = angle.limits
        figures = [degrees(x) for x in (limits.bias, limits.lower, limits.upper, angle.typical_error_rad)]
        lines.append(f"{_row(name, figures, 'deg')}{_icc(angle.icc)}{_pair(angle.pair, two)}")
    for name, own in found.annotators.items():
        mean, p95 = 1000 * own.mean_distance_m, 1000 * own.p95_distance_m
        if mean == mean:  # the bodies have a joint in common
            lines.append(f"{name}: {mean:.1f} mm from the consensus, 95% below {p95:.1f}")
    return "\n".join([*lines, *_worst(found, tolerance_m), *(f"note: {note}" for note in copies.notes)])


def _worst(found: "Agreement", tolerance_m: float | None) -> list[str]:
    worst = [d for d in found.worst if tolerance_m is None or d.distance_m > tolerance_m]
    if tolerance_m is None:
        lines = ["largest differences:"] if worst else []
    else:
        share = f"{len(worst)} of {len(found.worst)} poses"
        lines = [f"{share} differ by more than {1000 * tolerance_m:g} mm{':' * bool(worst)}"]
    for d in worst[:_LISTED]:
        pose, joint = f"frame {d.subject.frame}, {d.subject.person}", d.joint.replace("_", " ")
        lines.append(f"  {pose}: {joint} {1000 * d.distance_m:.0f} mm, {' and '.join(d.pair)}")
    if len(worst) > _LISTED:
        lines.append(f"  and {len(worst) - _LISTED} more; --json lists all")
    return lines


def _row(name: str, figures: Sequence[float], unit: str) -> str:
    bias, lower, upper, error = (f"{x:.1f}" if x == x else "-" for x in figures)
    return f"  {name.replace('_', ' '):23} {bias:>6} {lower:>8} to {upper:>5} {error:>10} {unit:9}"


def _icc(icc: "Icc") -> str:
    if icc.value != icc.value:
        return "-"
    return f"{icc.value:.3f}, {icc.interval[0]:.3f} to {icc.interval[1]:.3f}"


def _pair(pair: tuple[str, str], two: bool) -> str:
    return "" if two else f"   {pair[0]}, {pair[1]}"
