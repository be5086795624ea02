"""Calibrate cameras by key points of a person, without a board: pairs of views, a chain of cameras, one adjustment.

Imports `observations`, `calibration`, `boards` and the rooms below. Callers use
`keypoint_files.calibrate_filmed_person` for footage, and
`keypoint_calibration.calibrate_by_person` for key points.
"""

__all__ = ["keypoint_calibration", "keypoint_files"]
