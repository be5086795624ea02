"""The report of the simulated experiment of KRH08: Markdown with one SVG for each figure.

Line charts as SVG text.
"""

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel
from tracker.compute.sampling import without_gaps
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.geometry.arrays import Array
from tracker.simulate.experiments.contour_experiment import ACTORS, ExperimentResult
from tracker.simulate.experiments.contour_run import LOST_DEG, OBSERVABLE_DEG, RunResult
from tracker.simulate.experiments.convergence import MIN_GAIN, ROUGH_M, ROUGH_RAD

REPORT_FILE = "report.md"
_JOINTS = (("Fig. 6", "elbow"), ("Fig. 7", "shoulder"))
"""Figures of the paper that show the trajectories of joints."""
_FEW = 5
"""Largest number of iterations that the paper needs."""
_PAPER = ("2 (15 in frame 98)", "1", "3.7", "1.5")
"""What the paper reports: mean error, degrees; lost frames; contours before and after, px."""


def write_contour_report(out: Path, found: ExperimentResult) -> Path:
    """Write the report and its figures into a folder, and return the report's path.

    Args:
        out: folder; made where it is missing.
        found: results of the experiment.

    Raises:
        TrackerError: the folder cannot be written.
    """
    methods = list(dict.fromkeys(r.method for r in found.runs))
    figures: dict[str, str] = {}
    sections = [_head(found), _main_table(found, methods)]
    sections += [_errors_of(found, name, r, figures) for name, r in _main_runs(found, methods).items()]
    sections += [_trajectories(found, methods, figures), _convergence(found, figures), _rough(found)]
    sections.append(_cameras(found, methods, figures))
    text = "\n\n".join(sections) + "\n"
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, svg in figures.items():
            write_text_atomic(out / name, svg)
        write_text_atomic(out / REPORT_FILE, text)
    except OSError as error:
        raise TrackerError(f"cannot write the report to {out}: {error}; choose a folder you may write to") from error
    return out / REPORT_FILE


def _head(found: ExperimentResult) -> str:
    experiment, body = found.experiment, found.models["own shape"]
    return "\n\n".join([
        "# Simulated experiment of Knossow, Ronfard & Horaud 2008",
        f"{experiment.n_frames} frames, {experiment.n_cameras} cameras of 640x480 px, seed {experiment.seed}, contours "
        f"with {experiment.noise_px:g} px of noise. Every degree of freedom moves. The body `{body.name}` has "
        f"{body.n_dofs} degrees of freedom and is fitted to its own contours, as in Sect. 6. Tracking starts at the "
        "true pose of the first frame.",
        f"An angle is observable where its standard deviation at the true pose is below {OBSERVABLE_DEG:.0f} degrees "
        "with 1 px of noise. This is decided before anything is fitted. Errors are means over observable angles. A "
        f"frame is lost where its mean is above {LOST_DEG:.0f} degrees.",
    ])  # fmt: skip


def _main_runs(found: ExperimentResult, methods: Sequence[str]) -> dict[str, RunResult]:
    """Return the main run of each method, and that without the sliding term."""
    return {m: found.main(m) for m in methods} | dict(found.no_sliding)


def _main_table(found: ExperimentResult, methods: Sequence[str]) -> str:
    rows = [
        "| | mean angle error, deg | worst frame, deg | lost frames | contours before, px | contours after, px | "
        "at the true pose, px |",
        "|---|---|---|---|---|---|---|",
    ]
    for method, r in _main_runs(found, methods).items():
        worst = float(np.degrees(np.nanmax(r.frame_errors)))
        cells = [f"{np.degrees(r.mean_error):.2f}", f"{worst:.2f}", str(r.lost_frames)]
        cells += [f"{np.nanmean(px):.2f}" for px in (r.before_px, r.after_px, r.true_px)]
        rows.append(f"| {method} | {' | '.join(cells)} |")
    error, lost, before, after = _PAPER
    rows.append(f"| the paper | {error} | 15 | {lost} | {before} | {after} | |")
    share = 100 * found.main(methods[0]).observable.mean()
    return "\n".join(["## Result", "", *rows, "", f"Observable are {share:.0f}% of the degrees of freedom and frames."])


def _errors_of(found: ExperimentResult, method: str, r: RunResult, figures: dict[str, str]) -> str:
    slug = _slug(method)
    frames = np.arange(len(r.after_px), dtype=float)
    contours, angles = f"fig5a_{slug}.svg", f"fig5b_{slug}.svg"
    figures[contours] = line_chart(
        f"Fig. 5a: contours against image contours, {method}",
        frames,
        [Line("before", r.before_px), Line("after", r.after_px), Line("true pose", r.true_px, dashed=True)],
        "frame",
        "RMS, px",
    )
    figures[angles] = line_chart(
        f"Fig. 5b: mean error of the observable angles, {method}",
        frames,
        [Line("observable angles", np.degrees(r.frame_errors)), Line("all angles", np.degrees(_all_angles(found, r)))],
        "frame",
        "error, degrees",
    )
    return f"## Errors: {method}\n\n![Fig. 5a]({contours})\n\n![Fig. 5b]({angles})"


def _all_angles(found: ExperimentResult, r: RunResult) -> Array:
    return np.asarray(np.abs(r.errors)[:, ~found.models["own shape"].dof_is_length].mean(axis=1))


def _trajectories(found: ExperimentResult, methods: Sequence[str], figures: dict[str, str]) -> str:
    model, frames = found.models["own shape"], np.arange(len(found.truth), dtype=float)
    lines = ["## Trajectories"]
    for figure, joint in _JOINTS:
        for side in ("left", "right"):
            for dof in _dofs_of(model, f"{side}_{joint}"):
                name = model.dof_names[dof]
                file = f"{_slug(figure.replace('. ', ''))}_{_slug(name)}.svg"
                curves = [Line("truth", _degrees(model, found.truth, dof), dashed=True)]
                curves += [Line(m, _degrees(model, r.poses, dof)) for m, r in _main_runs(found, methods).items()]
                title = f"{figure}: {display_name(name)}"
                figures[file] = line_chart(title, frames, curves, "frame", "degrees")
                lines.append(f"![{title}]({file})")
    return "\n\n".join(lines)


def _dofs_of(model: BodyModel, joint: str) -> list[int]:
    return [i for i, n in enumerate(model.dof_names) if n.rpartition(".")[0] == joint]


def _degrees(model: BodyModel, poses: Array, dof: int) -> Array:
    return np.asarray(np.degrees(poses[:, model.dof_value[dof]]))


def _convergence(found: ExperimentResult, figures: dict[str, str]) -> str:
    lines = [
        "## Convergence",
        "",
        f"Every fifth frame is fitted from the true pose of an earlier frame, in the paper's mode with and without the "
        f"sliding term, and in the default mode. An iteration that lowers the RMS distance by less than "
        f"{100 * MIN_GAIN:.0f}% is the last. The paper reports 3 to 5 iterations and 1.5 px with the sliding term, "
        "twice as many iterations and 2.3 px without it.",
        "",
        f"| start | mode | iterations | contours before, px | after {_FEW} iterations, px | worst frame then, px | "
        "after, px |",
        "|---|---|---|---|---|---|---|",
    ]
    curves = []
    for c in found.convergence:
        start, rms = f"{c.back} frame{'s' * (c.back > 1)} earlier", c.rms_px
        means = rms.mean(axis=0)
        cells = [f"{px:.2f}" for px in (means[0], means[_FEW], rms[:, _FEW].max(), means[-1])]
        lines.append(f"| {start} | {c.mode} | {c.mean_iterations:.1f} | {' | '.join(cells)} |")
        curves.append(Line(f"{c.back} back, {c.mode}", means, dashed=c.mode == "paper, no sliding"))
    steps = np.arange(len(curves[0].values), dtype=float)
    title = "Fig. 13: contours against image contours, by iteration"
    figures["fig13.svg"] = line_chart(title, steps, curves, "iteration", "RMS, px")
    return "\n".join([*lines, "", "![Fig. 13](fig13.svg)"])


def _rough(found: ExperimentResult) -> str:
    by_chains, at_once = found.rough
    lines = [
        "## From a rough guess",
        "",
        f"The first frame from a guess with errors of {np.degrees(ROUGH_RAD):.0f} degrees in each angle and "
        f"{100 * ROUGH_M:.0f} cm in each coordinate of the root, in the paper's mode: incrementally, as in Sect. 6 and "
        "Fig. 9, and all degrees of freedom at once.",
        "",
        "| step | contours, px | points off, mm |",
        "|---|---|---|",
        *[f"| {s.name} | {s.rms_px:.2f} | {1000 * s.off_m:.0f} |" for s in (*by_chains, at_once[-1])],
    ]
    return "\n".join(lines)


def _cameras(found: ExperimentResult, methods: Sequence[str], figures: dict[str, str]) -> str:
    counts = sorted({r.n_cameras for r in found.runs})
    by_run = {(r.actor, r.n_cameras, r.method): r.result for r in found.runs}
    lines = [
        "## Number of cameras",
        "",
        "Mean error of the observable angles in degrees / lost frames / contours after, px (share observable).",
        "",
        f"| | {' | '.join(map(str, counts))} |",
        "|---" * (len(counts) + 1) + "|",
    ]
    for actor in ACTORS:
        for method in methods:
            row = [by_run[actor, n, method] for n in counts]
            cells = [
                f"{np.degrees(r.mean_error):.2f} / {r.lost_frames} / {np.nanmean(r.after_px):.2f} "
                f"({100 * r.observable.mean():.0f}%)"
                for r in row
            ]
            lines.append(f"| {actor}, {method} | {' | '.join(cells)} |")
    curves = [
        Line(f"{actor}, {m}", np.degrees([by_run[actor, n, m].mean_error for n in counts]))
        for actor in ACTORS
        for m in methods
    ]
    figures["cameras.svg"] = line_chart(
        "Mean angle error", np.array(counts, dtype=float), curves, "cameras", "error, degrees"
    )
    lines += ["", "![Mean angle error by the number of cameras](cameras.svg)", "",
              "The skinned person has other bones and another shape than the fitted body `"
              f"{found.models['skinned person'].name}`, which is scaled by height alone."]  # fmt: skip
    return "\n".join(lines)


def _slug(name: str) -> str:
    """Return a name for files: letters, digits and single underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


_SIZE, _MARGIN = (760, 260), (56, 14, 26, 40)
"""Width and height of a chart without its legend, and its margins left, right, top and bottom."""
_COLUMNS, _ROW = 3, 14
"""Columns of the legend, and the height of its rows."""
_COLORS = ("#1f6fb2", "#d1495b", "#3a8f5c", "#8a5fb5", "#b07a2a", "#555555")
_TICKS = 5
_FONT = 'font-family="sans-serif" font-size="11"'


class Line(NamedTuple):
    """One curve."""

    name: str
    values: Array
    """(n,); NaN leaves a gap."""
    dashed: bool = False


def line_chart(title: str, x: Array, lines: Sequence[Line], x_label: str, y_label: str) -> str:
    """Return a chart of curves over a common axis as SVG text.

    Args:
        title: of the chart.
        x: positions, (n,), ascending.
        lines: at least one curve.
        x_label: name and unit of the horizontal axis.
        y_label: name and unit of the vertical axis.
    """
    (width, height), (left, right, top, bottom) = _SIZE, _MARGIN
    legend = _ROW * -(-len(lines) // _COLUMNS)
    height, top = height + legend, top + legend
    finite = np.concatenate([line.values[np.isfinite(line.values)] for line in lines])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    low, high = min(low, 0.0), high if high > low else low + 1.0
    pad = 0.05 * (high - low)
    low, high = low - pad * (low < 0), high + pad
    first, last = float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1.0

    def u(value: float) -> float:
        return left + (value - first) / (last - first) * (width - left - right)

    def v(value: float) -> float:
        return height - bottom - (value - low) / (high - low) * (height - top - bottom)

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" {_FONT}>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        f'<text x="{left}" y="14" font-size="13" fill="#222222">{escape(title)}</text>',
    ]
    for tick in _ticks(low, high):
        out.append(f'<line x1="{left}" x2="{width - right}" y1="{v(tick):.1f}" y2="{v(tick):.1f}" stroke="#dddddd"/>')
        out.append(f'<text x="{left - 6}" y="{v(tick) + 4:.1f}" text-anchor="end" fill="#444444">{tick:g}</text>')
    for tick in _ticks(first, last):
        out.append(
            f'<text x="{u(tick):.1f}" y="{height - bottom + 14}" text-anchor="middle" fill="#444444">{tick:g}</text>'
        )
    for i, line in enumerate(lines):
        color, dash = _COLORS[i % len(_COLORS)], ' stroke-dasharray="5 3"' if line.dashed else ""
        for run in without_gaps(np.flatnonzero(np.isfinite(line.values))):
            points = " ".join(f"{u(float(x[k])):.1f},{v(float(line.values[k])):.1f}" for k in run)
            out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.6"{dash}/>')
        at, y = left + i % _COLUMNS * (width - left - right) // _COLUMNS, _MARGIN[2] + _ROW * (i // _COLUMNS)
        out.append(f'<line x1="{at}" x2="{at + 20}" y1="{y}" y2="{y}" stroke="{color}" stroke-width="2"{dash}/>')
        out.append(f'<text x="{at + 25}" y="{y + 4}" fill="#222222">{escape(line.name)}</text>')
    out.append(f'<text x="{(left + width - right) / 2}" y="{height - 8}" text-anchor="middle">{escape(x_label)}</text>')
    middle = (top + height - bottom) / 2
    out.append(
        f'<text x="14" y="{middle}" text-anchor="middle" transform="rotate(-90 14 {middle})">{escape(y_label)}</text>'
    )
    return "\n".join([*out, "</svg>\n"])


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers within a range."""
    step = 10.0 ** np.floor(np.log10((high - low) / _TICKS))
    step *= next(f for f in (1, 2, 5, 10) if (high - low) / (step * f) <= _TICKS + 1)
    return [round(float(t), 10) for t in np.arange(np.ceil(low / step) * step, high + 1e-9, step)]
