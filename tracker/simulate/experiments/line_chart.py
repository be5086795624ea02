"""Line charts as SVG text."""

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from tracker.compute.sampling import without_gaps
from tracker.geometry.arrays import Array

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
