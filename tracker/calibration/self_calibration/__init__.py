"""Calibrate cameras by people, without a board: by key points or silhouettes; a chain of cameras, one adjustment.

Imports the other rooms of its wing. Callers use
`person_files.calibrate_filmed_person` for footage, `keypoint_calibration.calibrate_by_person` for key points,
and `silhouette_calibration.calibrate_by_silhouettes` for silhouettes.
"""

__all__ = ["person_calibration", "person_files"]
