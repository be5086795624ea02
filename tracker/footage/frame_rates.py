"""Compare frame rates: equal within rounding, and one clock though written differently."""

RATE_TOLERANCE = 5e-4
"""Relative difference above which two frame rates differ; 29.97 and 30 differ by twice as much,
and 23.98 differs from 24000/1001 by a third."""
_CAMERA_RATES = (24000 / 1001, 24.0, 25.0, 30000 / 1001, 30.0, 50.0, 60000 / 1001, 60.0, 100.0, 120.0, 200.0, 240.0)
"""Frame rates of cameras and of television, 1/s."""


def same_rate(rate: float, other: float) -> bool:
    """Return whether two frame rates, 1/s, are equal within rounding."""
    return abs(rate / other - 1) <= RATE_TOLERANCE


def nominal_rate(rate: float) -> float:
    """Return the whole rate by which television's rate goes, 1/s: 30 for 30000/1001; other rates as they are."""
    whole = round(rate * 1.001)
    is_of_television = whole > 0 and (whole % 24 == 0 or whole % 30 == 0)
    return float(whole) if is_of_television and abs(rate * 1.001 / whole - 1) <= RATE_TOLERANCE else rate


def same_clock(rate: float, other: float) -> bool:
    """Return whether two frame rates, 1/s, name one clock: 29.97 is written as 30 by programs that round."""
    return same_rate(rate, other) or same_rate(nominal_rate(rate), nominal_rate(other))


def usual_rate(rate: float) -> float:
    """Return the rate of cameras within 1% of a measured rate, 1/s; if there is none, the rate in six digits."""
    nearest = min(_CAMERA_RATES, key=lambda r: abs(r / rate - 1))
    return nearest if abs(nearest / rate - 1) < 0.01 else float(f"{rate:.6g}")
