"""The agreement of annotators as plain data and as a table."""

import csv
import io
from collections.abc import Mapping, Sequence
from itertools import combinations
from math import degrees
from pathlib import Path
from typing import Any

from app.export.report_files import write_text, writing
from tracker.evaluation.agreement.comparison import Agreement, AngleAgreement, JointAgreement, compare
from tracker.evaluation.agreement.copies import Copies, mean_points
from tracker.evaluation.agreement.statistics import Icc, Limits
from tracker.formats.trc import write_trc
from tracker.geometry.arrays import Array

Pairs = Mapping[tuple[str, str], Agreement]

_COLUMNS = (
    "annotator_a", "annotator_b", "quantity", "name", "unit", "n", "bias", "bias_low", "bias_high", "lower_limit",
    "lower_limit_low", "lower_limit_high", "upper_limit", "upper_limit_low", "upper_limit_high", "typical_error", "icc",
    "icc_low", "icc_high",
)  # fmt: skip


def pairs_of(copies: Copies) -> Pairs:
    """Compare each pair of annotators."""
    indices = combinations(range(len(copies.names)), 2)
    return {(copies.names[a], copies.names[b]): compare(copies, (a, b)) for a, b in indices}


def agreement_record(
    copies: Copies, found: Agreement, pairs: Pairs, poses: str, tolerance_m: float | None
) -> dict[str, Any]:
    """Return a comparison as one JSON object, in millimetres and degrees."""
    record = {
        "poses": poses,
        "n": len(copies.subjects),
        "icc_form": "ICC(A,1)",
        **_figures(found),
        "annotators": {
            name: {
                "mean_mm": 1000 * own.mean_distance_m,
                "p95_mm": 1000 * own.p95_distance_m,
                "joints": {
                    joint: {"bias_mm": _mm(bias), "mean_mm": 1000 * own.joint_distance_m[joint]}
                    for joint, bias in own.bias_m.items()
                },
            }
            for name, own in found.annotators.items()
        },
        "worst": [
            {
                "frame": d.subject.frame, "person": d.subject.person, "joint": d.joint,
                "distance_mm": 1000 * d.distance_m, "annotators": d.pair,
            }
            for d in found.worst
            if tolerance_m is None or d.distance_m > tolerance_m
        ],
        "tolerance_mm": None if tolerance_m is None else 1000 * tolerance_m,
        "notes": copies.notes,
    }  # fmt: skip
    if len(pairs) > 1:
        record["pairs"] = [{"annotators": names, **_figures(of)} for names, of in pairs.items()]
    people = list(dict.fromkeys(s.person for s in copies.subjects))
    if len(people) > 1:
        record["people"] = {name: _figures(compare(copies, people=[name])) for name in people}
    return record


def write_table(copies: Copies, path: Path) -> None:
    """Write the figures of each pair of annotators as CSV, which appears complete or not at all.

    A joint has four rows: along the line of its bias, and along each axis of the world.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for names, of in pairs_of(copies).items():
        for name, joint in of.joints.items():
            lines = [("joint", joint.along, joint.typical_error_m, joint.icc)]
            axes = zip("xyz", joint.by_axis, joint.typical_error_by_axis_m, joint.icc_by_axis, strict=True)
            lines += [(f"joint {axis}", limits, error, icc) for axis, limits, error, icc in axes]
            for quantity, limits, error, icc in lines:
                writer.writerow([*names, quantity, name, "mm", joint.n, *_row(limits, error, icc, 1000)])
        for name, angle in of.angles.items():
            figures = _row(angle.limits, angle.typical_error_rad, angle.icc, degrees(1))
            writer.writerow([*names, "angle", name, "deg", angle.n, *figures])
    write_text(path, text.getvalue())


def write_consensus(copies: Copies, path: Path) -> None:
    """Write the mean joints of all annotators as TRC, in the names and axes of the session, metres.

    Args:
        copies: their poses of one person.
        path: the file.

    Raises:
        TrackerError: the file cannot be written.
    """
    frames = [s.frame for s in copies.subjects]
    with writing(path):
        write_trc(path, copies.joints, mean_points(copies.points), copies.fps, frames=frames)


def _row(limits: Limits, error: float, icc: Icc, unit: float) -> list[str]:
    lower, upper = (limits.lower, *limits.lower_interval), (limits.upper, *limits.upper_interval)
    scaled = [limits.bias, *limits.bias_interval, *lower, *upper, error]
    return [_number(unit * x) for x in scaled] + [_number(x) for x in (icc.value, *icc.interval)]


def _number(value: float) -> str:
    return "" if value != value else f"{value:.6g}"


def _figures(found: Agreement) -> dict[str, Any]:
    return {
        "joints": {name: _joint(joint) for name, joint in found.joints.items()},
        "angles": {name: _angle(angle) for name, angle in found.angles.items()},
    }


def _joint(joint: JointAgreement) -> dict[str, Any]:
    return {
        "annotators": joint.pair,
        "n": joint.n,
        "bias_mm": _mm(joint.bias_m),
        "bias_length_mm": 1000 * joint.along.bias,
        "bias_length_interval_mm": _mm(joint.along.bias_interval),
        "limits_mm": _mm((joint.along.lower, joint.along.upper)),
        "limits_intervals_mm": [_mm(joint.along.lower_interval), _mm(joint.along.upper_interval)],
        "bias_intervals_by_axis_mm": [_mm(axis.bias_interval) for axis in joint.by_axis],
        "limits_by_axis_mm": [_mm((axis.lower, axis.upper)) for axis in joint.by_axis],
        "typical_error_mm": 1000 * joint.typical_error_m,
        "typical_error_by_axis_mm": _mm(joint.typical_error_by_axis_m),
        "icc": joint.icc.value,
        "icc_interval": joint.icc.interval,
        "icc_by_axis": [icc.value for icc in joint.icc_by_axis],
        "icc_intervals_by_axis": [icc.interval for icc in joint.icc_by_axis],
        "mean_distance_mm": 1000 * joint.mean_distance_m,
        "p95_distance_mm": 1000 * joint.p95_distance_m,
    }


def _angle(angle: AngleAgreement) -> dict[str, Any]:
    limits = angle.limits
    return {
        "annotators": angle.pair,
        "n": angle.n,
        "bias_deg": degrees(limits.bias),
        "bias_interval_deg": _degrees(limits.bias_interval),
        "limits_deg": _degrees((limits.lower, limits.upper)),
        "limits_intervals_deg": [_degrees(limits.lower_interval), _degrees(limits.upper_interval)],
        "typical_error_deg": degrees(angle.typical_error_rad),
        "icc": angle.icc.value,
        "icc_interval": angle.icc.interval,
    }


def _mm(values: Sequence[float] | Array) -> list[float]:
    return [1000 * float(v) for v in values]


def _degrees(values: Sequence[float]) -> list[float]:
    return [degrees(v) for v in values]
