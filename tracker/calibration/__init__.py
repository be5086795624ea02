"""Corrections of calibrated cameras: derivatives of projections by a camera, and bundle adjustment of points.

Imports `geometry` and `fitting`; knows no session. `tracker.calibrations`, in the plural, reads the files of other
programs. Callers use `camera_columns.project_with_columns` and `point_adjustment.adjust_points`.
"""
