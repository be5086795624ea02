"""Calibrations of other programs: one table of layouts, each recognized by content and read to the anipose layout.

Imports `geometry` and `formats`; knows no session. `reading.read_cameras` reads files, `layouts.layouts` is the table,
`pose_conventions` tests where the cameras look and stand.
"""

__all__ = ["calibration_layout", "convention_names", "pose_conventions", "reading", "writing"]
