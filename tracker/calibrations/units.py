"""Check that the translations of a calibration can have their unit, and name the unit that they can have."""

from collections.abc import Sequence

import numpy as np

from tracker.errors import CalibrationError, Remedy
from tracker.formats.camera_section import METRES, CameraEntry, Units
from tracker.geometry.arrays import Array
from tracker.geometry.camera_rig import MIN_APART_M, axes_point

MAX_STUDIO_M = 100.0
"""Distance from the point at which cameras look, or from the origin, at which none shows a person:
1.7 m are 15 px high there in a picture of 1,000 px and 60 degrees."""
MIN_STUDIO_M = 0.5
"""Distance nearer than which cameras show no person: at it, a lens of 60 degrees sees 58 cm."""
_WORDS = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}


def check_units(entries: Sequence[CameraEntry], where: str, units: Units, square: float | None) -> list[str]:
    """Check the unit of cameras that were read with it.

    Args:
        entries: the cameras, in metres.
        where: names the file in messages.
        units: the unit as which their translations were read.
        square: side of a square of the board in the file's unit, if it states one.

    Returns:
        Notes: evidence for another unit.

    Raises:
        CalibrationError: the cameras would stand where they cannot show a person.
    """
    distance_m, place, sees_point = _distance(entries)
    in_units = distance_m / METRES[units]
    squares = "multiply the translations by the side of a square of the board in metres"
    least = MIN_STUDIO_M if sees_point else MIN_APART_M
    # Metres are the default of a file that may show a table or a head; another unit was chosen.
    found = f"{in_units:.3g}" if in_units < 1000 else f"{in_units:.0f}"
    limit = f"within {MAX_STUDIO_M:g} m" if distance_m > MAX_STUDIO_M else f"at least {least:g} m"
    if distance_m > MAX_STUDIO_M or (units != "m" and 0 < distance_m < least):
        raise CalibrationError(
            f"{where}: expected cameras {limit} {place}, found {found} {_WORDS[units]}, so that the unit is another"
            + (f"; {squares}" if square == 1 else ""),
            None if square == 1 else _remedy(in_units, units),
        )
    notes = []
    if square == 1:
        notes.append(
            f"The cameras stand {distance_m:.3g} m {place}, and the file says that a square of its board is 1 wide: if "
            f"its lengths count squares, {squares}."
        )
    elif distance_m < (least if units == "m" else MIN_STUDIO_M):
        notes.append(f"All cameras stand within {distance_m:.2g} m {place}: check that the unit is {_WORDS[units]}.")
    return notes


def _distance(entries: Sequence[CameraEntry]) -> tuple[float, str, bool]:
    """Return how far cameras stand from where they look, metres; without such a point, from the origin.

    Returns:
        The distance, from what, and whether there is a point at which they look.
    """
    Ts: list[Array] = [entry.T_world_camera for entry in entries]
    point = axes_point(Ts)
    if len(Ts) > 1 and point.is_determined and point.angles_rad.max() < np.pi / 3:
        return float(np.median(point.distances)), "from the point at which they look", True
    return max(float(np.linalg.norm(T[:3, 3])) for T in Ts), "from the origin", False


def _remedy(distance: float, units: Units) -> Remedy:
    """Name the units by which the distance is that of a studio, first the one nearest to the middle of these."""
    fitting = [u for u in METRES if u != units and MIN_STUDIO_M <= distance * METRES[u] <= MAX_STUDIO_M]
    fitting.sort(key=lambda u: abs(np.log((distance * METRES[u]) ** 2 / (MIN_STUDIO_M * MAX_STUDIO_M))))
    if not fitting:
        return Remedy("scale_calibration", units=", ".join(METRES))
    return Remedy("give_unit", units=" or ".join(f"{u} ({distance * METRES[u]:.2g} m)" for u in fitting))
