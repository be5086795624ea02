"""Compare frame rates: equal within rounding, and one clock though written differently."""

RATE_TOLERANCE = 5e-4
"""Relative difference above which two frame rates differ; 29.97 and 30 differ by twice as much,
and 23.98 differs from 24000/1001 by a third."""
DROP = 1.001
"""Whole rates over those of television: 30 for 30000/1001 per second."""
LONG_INTERVAL = 1.5
"""Interval between frames, in usual ones, above which a frame may be missing in it."""
_TELEVISION_RATES = (24.0, 30.0, 60.0)
"""Whole frame rates by which television's go, 1/s."""
_CAMERA_RATES = (*_TELEVISION_RATES, *(r / DROP for r in _TELEVISION_RATES), 25.0, 50.0, 100.0, 120.0, 200.0, 240.0)
"""Frame rates of cameras and of television, 1/s."""


def same_rate(rate: float, other: float) -> bool:
    """Return whether two frame rates, 1/s, are equal within rounding."""
    return abs(rate / other - 1) <= RATE_TOLERANCE


def nominal_rate(rate: float) -> float:
    """Return the whole rate by which television's rate goes, 1/s: 30 for 30000/1001; other rates as they are."""
    whole = round(rate * DROP)
    is_of_television = whole > 0 and (whole % 24 == 0 or whole % 30 == 0)
    return float(whole) if is_of_television and abs(rate * DROP / whole - 1) <= RATE_TOLERANCE else rate


def same_clock(rate: float, other: float) -> bool:
    """Return whether two frame rates, 1/s, name one clock: 29.97 is written as 30 by programs that round."""
    return same_rate(rate, other) or same_rate(nominal_rate(rate), nominal_rate(other))


def usual_rate(rate: float) -> float:
    """Return the rate of cameras within 1% of a measured rate, 1/s; if there is none, the rate in six digits."""
    nearest = min(_CAMERA_RATES, key=lambda r: abs(r / rate - 1))
    return nearest if abs(nearest / rate - 1) < 0.01 else float(f"{rate:.6g}")
