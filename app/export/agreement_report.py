"""Write the agreement of annotators as one HTML file: Bland-Altman plots, tables, the worst frames."""

import html
from collections.abc import Callable, Sequence
from math import degrees
from pathlib import Path

import numpy as np

from app.export.report_files import write_html
from tracker.evaluation.agreement.comparison import Agreement, JointAgreement
from tracker.evaluation.agreement.copies import Copies
from tracker.evaluation.agreement.statistics import Icc, Interval, Limits
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import Array

_SHOWN = 30
"""Number of frames in the list of the largest differences."""
_WIDTH, _HEIGHT = 340, 210
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 10, 24, 34
"""Size of a plot and its margins, px."""
_STYLE = """
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(340px, 1fr)); gap: .8rem; }
svg { width: 100%; font: 11px system-ui, sans-serif; } svg text { fill: currentColor; }
svg .title { font-size: 13px; font-weight: 600; } svg .frame { stroke: currentColor; stroke-opacity: .35; fill: none; }
svg .zero { stroke: currentColor; stroke-opacity: .35; stroke-dasharray: 2 3; }
svg .bias { stroke: #2a7de1; stroke-width: 1.5; } svg .limit { stroke: #d9622b; stroke-dasharray: 6 3; }
svg .band { fill-opacity: .15; } svg .bias.band { fill: #2a7de1; stroke: none; }
svg .limit.band { fill: #d9622b; stroke: none; }
svg circle { fill: currentColor; fill-opacity: .6; }
table { font-size: 14px; } td { white-space: nowrap; } th { vertical-align: bottom; } th.number { text-align: right; }
"""


def write_report(copies: Copies, found: Agreement, tolerance_m: float | None, path: Path) -> None:
    """Write the report of a comparison.

    Args:
        copies: the poses that were compared.
        found: the comparison of all annotators.
        tolerance_m: distance above which a pose is listed; None lists the largest ones.
        path: the file; it appears complete or not at all.
    """
    title = f"Agreement of {', '.join(copies.names)}"
    order = " less ".join(reversed(copies.names)) if len(copies.names) == 2 else "second less first of the pair named"
    plotted = [(joint, found.joints[joint]) for joint in LIMB_JOINTS if joint in found.joints]
    plots = [_plot(_label(name, joint.pair, found), joint) for name, joint in plotted]
    body = [
        f"<h1>{html.escape(title)}</h1><p>{len(copies.subjects)} poses. Differences: {html.escape(order)}. Intervals "
        "are 95%, each of one joint or angle. Those of a joint hold along every line in space.</p>",
        *(f"<p>Note: {html.escape(note)}.</p>" for note in copies.notes),
        "<h2>Bland-Altman plots of the limb joints</h2>",
        "<p>Difference against mean of two, both along the line of the joint's bias. "
        "Bands are the confidence intervals of bias and limits.</p>",
        f'<div class="plots">{"".join(plots)}</div>',
        *_joints(found),
        *_angles(found),
        *_annotators(found),
        *_worst(found, tolerance_m),
    ]
    write_html(path, title, body, _STYLE)


def _plot(name: str, joint: JointAgreement) -> str:
    """Draw the Bland-Altman plot of a joint; the means are centred, since the origin of the world is arbitrary."""
    means_cm = 100 * (joint.means_m - joint.means_m.mean())
    differences_mm = 1000 * joint.differences_m
    along = joint.along
    bias, lower, upper = lines = [1000 * x for x in (along.bias, along.lower, along.upper)]
    bands = [1000 * np.array(x) for x in (along.bias_interval, along.lower_interval, along.upper_interval)]
    reach = np.concatenate([differences_mm, np.ravel(lines), np.ravel(bands), [0.0]])
    x = _scale(means_cm, _LEFT, _WIDTH - _RIGHT)
    y = _scale(reach[np.isfinite(reach)], _HEIGHT - _BOTTOM, _TOP)
    right = _WIDTH - _RIGHT
    marks = [
        f'<rect class="frame" x="{_LEFT}" y="{_TOP}" width="{right - _LEFT}" height="{_HEIGHT - _BOTTOM - _TOP}"/>'
    ]
    marks.append(f'<line class="zero" x1="{_LEFT}" x2="{right}" y1="{y(0):.1f}" y2="{y(0):.1f}"/>')
    for kind, value, (low, high) in zip(("bias", "limit", "limit"), lines, bands, strict=True):
        if np.isfinite([low, high]).all():
            size = f'y="{y(high):.1f}" height="{y(low) - y(high):.1f}"'
            marks.append(f'<rect class="{kind} band" x="{_LEFT}" width="{right - _LEFT}" {size}/>')
        if np.isfinite(value):
            marks.append(f'<line class="{kind}" x1="{_LEFT}" x2="{right}" y1="{y(value):.1f}" y2="{y(value):.1f}"/>')
            marks.append(f'<text x="{_LEFT - 5}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.1f}</text>')
    marks += [
        f'<circle cx="{x(a):.1f}" cy="{y(b):.1f}" r="2.5"/>' for a, b in zip(means_cm, differences_mm, strict=True)
    ]
    for value, anchor in ((float(means_cm.min()), "start"), (float(means_cm.max()), "end")):
        marks.append(f'<text x="{x(value):.1f}" y="{_HEIGHT - 20}" text-anchor="{anchor}">{value:.1f}</text>')
    middle = (_LEFT + right) / 2
    marks.append(f'<text x="{middle}" y="{_HEIGHT - 5}" text-anchor="middle">mean, cm from the middle</text>')
    marks.append(f'<text x="{_LEFT - 5}" y="{_TOP - 8}" text-anchor="end">mm</text>')
    marks.append(f'<text class="title" x="{_LEFT}" y="{_TOP - 8}">{_words(name)}</text>')
    label = f"{_words(name)}: bias {_cell(bias)} mm, limits {_interval((lower, upper), 1, 1)} mm"
    return f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">{"".join(marks)}</svg>'


def _scale(values: Array, start: float, end: float) -> Callable[[float], float]:
    """Return the map from the range of values, a little widened, to pixels."""
    low, high = float(values.min()), float(values.max())
    widened = 0.06 * (high - low) or 1.0
    low, high = low - widened, high + widened
    return lambda value: start + (end - start) * (float(value) - low) / (high - low)


def _joints(found: Agreement) -> list[str]:
    out = ["<h2>Joints, mm</h2>", _head("bias x", "y", "z", "length", *_SHARED)]
    for name, joint in found.joints.items():
        numbers = [*(1000 * joint.bias_m), 1000 * joint.along.bias]
        out.append(
            _row(_label(name, joint.pair, found), numbers, joint.along, 1000, joint.typical_error_m, joint.icc, joint.n)
        )
    return [*out, "</table>"]


def _angles(found: Agreement) -> list[str]:
    out = ["<h2>Angles, degrees</h2>", _head("bias", *_SHARED)]
    for name, angle in found.angles.items():
        bias = [degrees(angle.limits.bias)]
        out.append(
            _row(
                _label(name, angle.pair, found),
                bias,
                angle.limits,
                degrees(1),
                angle.typical_error_rad,
                angle.icc,
                angle.n,
            )
        )
    return [*out, "</table>"]


_SHARED = ("lower limit", "interval", "upper limit", "interval", "typical error", "ICC(A,1)", "interval", "poses")
"""Columns of joints and of angles."""


def _head(*columns: str) -> str:
    return f"<table><tr><th>{''.join(f'<th class=number>{c}' for c in columns)}</tr>"


def _row(name: str, numbers: Sequence[float], limits: Limits, unit: float, error: float, icc: Icc, n: int) -> str:
    cells = [_cell(x) for x in numbers]
    for value, interval in ((limits.lower, limits.lower_interval), (limits.upper, limits.upper_interval)):
        cells += [_cell(unit * value), _interval(interval, unit, 1)]
    cells += [_cell(unit * error), _cell(icc.value, 3), _interval(icc.interval, 1, 3), str(n)]
    return f"<tr><td>{_words(name)}{_numbers(cells)}</tr>"


def _annotators(found: Agreement) -> list[str]:
    out = ["<h2>Against the consensus, mm</h2>", _head("mean distance", "95%")]
    for name, own in found.annotators.items():
        cells = [_cell(1000 * own.mean_distance_m), _cell(1000 * own.p95_distance_m)]
        out.append(f"<tr><td>{html.escape(name)}{_numbers(cells)}</tr>")
    return [*out, "</table>"]


def _worst(found: Agreement, tolerance_m: float | None) -> list[str]:
    worst = [d for d in found.worst if tolerance_m is None or d.distance_m > tolerance_m]
    title = "Largest differences"
    if tolerance_m is not None:
        title = f"{len(worst)} of {len(found.worst)} poses differ by more than {1000 * tolerance_m:g} mm"
    out = [f"<h2>{title}</h2>"]
    if len(worst) > _SHOWN:
        out.append(f"<p>The first {_SHOWN} are listed.</p>")
    out.append("<table><tr><th><th>person<th>joint<th class=number>distance, mm<th>between</tr>")
    for d in worst[:_SHOWN]:
        texts = (d.subject.person, d.joint.replace("_", " "))
        cells = "".join(f"<td>{html.escape(text)}" for text in texts)
        between = html.escape(" and ".join(d.pair))
        distance = _numbers([f"{1000 * d.distance_m:.1f}"])
        out.append(f"<tr><td>frame {d.subject.frame}{cells}{distance}<td>{between}</tr>")
    return [*out, "</table>"]


def _numbers(cells: Sequence[str]) -> str:
    return "".join(f'<td class="number">{cell}' for cell in cells)


def _cell(value: float, digits: int = 1) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def _interval(interval: Interval, unit: float, digits: int) -> str:
    if not np.isfinite(interval).all():
        return "-"
    return " to ".join(_cell(unit * end, digits) for end in interval)


def _label(name: str, pair: tuple[str, str], found: Agreement) -> str:
    """Return a name; of more than two annotators, with the pair that the figures are of."""
    return name if len(found.annotators) == 2 else f"{name} ({pair[0]}, {pair[1]})"


def _words(name: str) -> str:
    return html.escape(name.replace("_", " "))
