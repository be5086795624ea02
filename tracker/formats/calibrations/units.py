"""Check that the translations of a calibration can have their unit, and name the unit that they can have."""

from collections.abc import Sequence

import numpy as np

from tracker.errors import CalibrationError, Remedy
from tracker.formats.anipose import METRES, CameraEntry, Units
from tracker.geometry.arrays import Array
from tracker.geometry.camera_rig import MIN_APART_M, axes_point
from tracker.geometry.cameras import MAX_PINHOLE_ANGLE
from tracker.geometry.lengths import USUAL_SIZES
from tracker.validation import quoted

_DISTANCE, _FOCAL = USUAL_SIZES["distance"], USUAL_SIZES["focal length"]
_WORDS = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}


def check_units(
    entries: Sequence[CameraEntry],
    where: str,
    units: Units,
    square: float | None,
    any_size: bool = False,
    is_sure: bool = True,
) -> list[str]:
    """Check the unit of cameras that were read with it.

    Args:
        entries: the cameras, in metres.
        where: names the file in messages.
        units: the unit as which their translations were read.
        square: side of a square of the board in the file's unit, if it states one.
        any_size: whether unusual distances are noted only.
        is_sure: whether the unit is stated; else one by which the distance is more usual is refused.

    Returns:
        Notes: evidence for another unit.

    Raises:
        CalibrationError: the cameras would stand where they cannot show a person.
    """
    distance_m, place, sees_point = _distance(entries)
    in_units = distance_m / METRES[units]
    squares = "multiply the translations by the side of a square of the board in metres"
    least = _DISTANCE.low if sees_point else MIN_APART_M
    found = f"{in_units:.3g}" if in_units < 1000 else f"{in_units:.0f}"
    is_far = distance_m > _DISTANCE.high
    limit = f"within {_DISTANCE.high:g} m" if is_far else f"at least {least:g} m"
    counts_squares = square == 1 and units == "m"  # which is noted
    if not (any_size or counts_squares) and (is_far or 0 < distance_m < least):
        other = f"{found} {_WORDS[units]}, so that the unit is another"
        advice = squares if square == 1 else _remedy(in_units, units)
        raise CalibrationError.mismatch(where, f"cameras {limit} {place}", other, advice)
    if not (is_sure or any_size) and _DISTANCE.units_of(in_units, METRES)[:1] not in ([], [units]):
        found = f"{found} {_WORDS[units]} {place}, so that the unit may be another"
        raise CalibrationError.mismatch(where, "a unit", found, _remedy(in_units, units))
    notes = []
    if square == 1:
        notes.append(
            f"The cameras stand {distance_m:.3g} m {place}, and the file says that a square of its board is 1 wide: if "
            f"its lengths count squares, {squares}."
        )
    elif not _DISTANCE.has(distance_m):
        within = "" if is_far else "within "
        notes.append(f"All cameras stand {within}{distance_m:.2g} m {place}: check that the unit is {_WORDS[units]}.")
    return notes


def check_focal_lengths(entries: Sequence[CameraEntry], where: str) -> None:
    """Check that focal lengths are those of lenses by which people are filmed.

    Raises:
        CalibrationError: one is not.
    """
    for entry in entries:
        side = max(entry.size or 2 * entry.K[:2, 2] + 1)
        share = float(entry.K[0, 0]) / side
        # Pictures of a fisheye that a program has undistorted are wider than those of any lens without distortion.
        low = _FOCAL.low if np.any(entry.distortion) else round(0.5 / np.tan(MAX_PINHOLE_ANGLE), 2)
        if share > _FOCAL.high or (share < low and not entry.fisheye):
            expected = f"a focal length of {low:g} to {_FOCAL.high:g} times the longer side of the picture"
            found = f"{share:.2g} times ({entry.K[0, 0]:.5g} px of {side:.0f})"
            here = f"{where}, camera {quoted(entry.name)}"
            raise CalibrationError.mismatch(here, expected, found, Remedy("any_size"))


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
    fitting = _DISTANCE.units_of(distance, {unit: metres for unit, metres in METRES.items() if unit != units})
    if not fitting:
        return Remedy("scale_calibration", units=", ".join(METRES))
    return Remedy("give_unit", units=" or ".join(f"{u} ({distance * METRES[u]:.2g} m)" for u in fitting))
