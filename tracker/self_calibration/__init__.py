"""Calibrate cameras by key points of a person, without a board: pairs of views, a chain of cameras, one adjustment.

Imports `observations`, `calibration`, `boards` and the rooms below. Callers use
`keypoint_calibration.calibrate_by_person`.
"""

__all__ = ["keypoint_calibration"]
