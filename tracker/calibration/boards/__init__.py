"""Calibrate cameras by footage of a board: corners, lenses, a graph of shared boards, and one adjustment of all.

Imports `calibration.check` of its wing; knows no session. Callers use `board_description.read_board`,
`footage_calibration.read_corners` and `board_calibration.calibrate_rig`.
"""

__all__ = [
    "board_calibration",
    "board_description",
    "camera_graph",
    "expected_error",
    "footage_calibration",
    "rig_fit",
    "view_choice",
]
