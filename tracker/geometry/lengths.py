"""Units of lengths, and the sizes that things usually have: another size is likely one in another unit."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tracker.errors import Remedy, TrackerError

METRES_BY_WORD = {
    word: metres
    for words, metres in (
        ("m meter meters metre metres", 1.0),
        ("cm centimeter centimeters centimetre centimetres", 0.01),
        ("mm millimeter millimeters millimetre millimetres", 0.001),
        ("in inch inches", 0.0254),
        ("ft foot feet", 0.3048),
    )
    for word in words.split()
}
"""Metres per unit, by the words that programs write for it, in any case."""


class UsualSize(NamedTuple):
    """Sizes that a kind of thing has."""

    low: float
    """Smallest one, metres; of focal lengths, the longer side of the picture."""
    high: float
    """Largest one."""

    def has(self, size: float) -> bool:
        """Return whether a size is usual; one that is no number is not."""
        return bool(self.low <= size <= self.high)

    def units_of(self, number: float, metres: Mapping[str, float]) -> list[str]:
        """Return the units, of those with their metres, in which a number is usual, nearest to the middle first."""
        fitting = [unit for unit in metres if self.has(number * metres[unit])]
        return sorted(fitting, key=lambda unit: self.distance(number * metres[unit]))

    def distance(self, size: float) -> float:
        """Return how far a size is from the middle, as twice the logarithm of their ratio."""
        return abs(np.log(size**2 / (self.low * self.high))) if size > 0 else np.inf


USUAL_SIZES: Mapping[str, UsualSize] = {
    "square": UsualSize(0.005, 0.3),
    "distance": UsualSize(0.5, 60.0),
    "person": UsualSize(0.6, 2.3),
    "focal length": UsualSize(0.3, 5.0),
}
"""By kind of thing. Squares of a board: from one that is as small as a hand to one that two people carry. Distance of
cameras from what they look at: a person fills a lens of 60 degrees at 0.5 m, and has 25 px of 1,000 at 60 m. People: of
those who walk, the smallest have 0.6 m, and few have 2.3 m (WHO growth standards). Focal lengths: fields of view of 118
to 11 degrees. Fisheyes have shorter ones, and undistorted pictures of them up to 140 degrees (`MAX_PINHOLE_ANGLE`)."""
_UNITS = {word: METRES_BY_WORD[unit] for word, unit in {
    "metres": "m", "centimetres": "cm", "millimetres": "mm", "inches": "in"
}.items()}  # fmt: skip


def height_m(number: float) -> float:
    """Return the height of a person in metres, of a number in metres or centimetres, whichever is nearer to usual."""
    return min(number, number * _UNITS["centimetres"], key=USUAL_SIZES["person"].distance)


def check_heights(heights_m: Mapping[str, float] | float | None, error: type[TrackerError]) -> None:
    """Check that people, of one height or by name, are as tall as people are.

    Raises:
        TrackerError: of the given kind; one is not.
    """
    for height in heights_m.values() if isinstance(heights_m, Mapping) else [heights_m]:
        if height is not None:
            check_usual(height, "person", "expected the height of a person", "metres", error)


def check_usual(number: float, kind: str, where: str, unit: str, error: type[TrackerError]) -> None:
    """Check that a length in a stated unit is usual.

    Args:
        number: the length.
        kind: of thing, a key of `USUAL_SIZES`.
        where: names the thing in the message: `board b.toml: expected the side of a square`.
        unit: of the number, a word such as `millimetres`.
        error: kind of error to raise.

    Raises:
        TrackerError: it is not usual; the message names the units in which it would be.
    """
    usual, metres = USUAL_SIZES[kind], _UNITS[unit]
    if usual.has(number * metres):
        return
    others = usual.units_of(number, {word: size for word, size in _UNITS.items() if word != unit})
    asked = ""
    if others:
        said = " or ".join(f"{number * _UNITS[word] / metres:.3g}" for word in others)
        asked = f"; is it in {' or '.join(others)}? say {said}"
    low, high = (f"{bound / metres:g}" for bound in usual)
    remedy = Remedy("any_size")
    if not np.isfinite(number):
        asked, remedy = "; give a number", None
    raise error(f"{where} of {low} to {high} {unit}, found {number:g}{asked}", remedy)
