"""Draw reliability curves as SVG: how often something happened, by the probability that was given."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

SIZE, LEFT, TOP, SIDE = (520, 470), 64, 24, 380
COLORS, INK, GRID = ("#d9822b", "#3d8bd4"), "#1d2733", "#cfd6de"
TICKS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
FONT = "font-family='system-ui, sans-serif'"


class Curve(NamedTuple):
    """The reliability of one kind of probability."""

    name: str
    bins: list[tuple[float, float]]
    """Lowest and highest probability of each group."""
    points: list[tuple[float, float, int]]
    """Mean probability, share that happened and size of each group."""


def reliability_svg(curves: Sequence[Curve]) -> str:
    """Return the picture. Both axes are logarithmic; a reliable curve lies on the diagonal."""
    width, height = SIZE
    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' {FONT} font-size='13'>",
        f"<rect width='{width}' height='{height}' rx='10' fill='#f7f8fa'/>",
    ]
    for tick in TICKS:
        x, y, text = _x(tick), _y(tick), f"{100 * tick:g}%"
        out += [
            f"<path d='M{x:.1f} {TOP}V{TOP + SIDE}M{LEFT} {y:.1f}H{LEFT + SIDE}' stroke='{GRID}'/>",
            f"<text x='{x:.1f}' y='{TOP + SIDE + 18}' text-anchor='middle' fill='{INK}'>{text}</text>",
            f"<text x='{LEFT - 8}' y='{y + 4:.1f}' text-anchor='end' fill='{INK}'>{text}</text>",
        ]
    ends = f"M{_x(TICKS[0]):.1f} {_y(TICKS[0]):.1f}L{_x(1):.1f} {_y(1):.1f}"
    out.append(f"<path d='{ends}' stroke='{INK}' stroke-dasharray='4 4'/>")
    for i, (curve, color) in enumerate(zip(curves, COLORS, strict=False)):
        at = [(_x(p), _y(share)) for p, share, _ in curve.points]
        path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in at)
        out.append(f"<path d='{path}' fill='none' stroke='{color}' stroke-width='2'/>")
        out += [f"<circle cx='{x:.1f}' cy='{y:.1f}' r='4' fill='{color}'/>" for x, y in at]
        out.append(
            f"<text x='{LEFT + 14}' y='{TOP + 22 + 20 * i}' fill='{color}' font-weight='600'>{curve.name}</text>"
        )
    out += [
        f"<text x='{LEFT + SIDE / 2}' y='{height - 14}' text-anchor='middle' fill='{INK}'>probability given</text>",
        f"<text transform='translate(16 {TOP + SIDE / 2}) rotate(-90)' text-anchor='middle' fill='{INK}'>"
        "share of limbs for which it was so</text>",
        "</svg>",
    ]
    return "\n".join(out) + "\n"


def _along(value: float) -> float:
    """Return where a share lies between the first and the last tick, 0 to 1."""
    low, high = np.log(TICKS[0]), np.log(TICKS[-1])
    return float((np.log(max(value, TICKS[0])) - low) / (high - low))


def _x(value: float) -> float:
    return LEFT + SIDE * _along(value)


def _y(value: float) -> float:
    return TOP + SIDE * (1 - _along(value))
