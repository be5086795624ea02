"""Is the calibration right, which camera is off, by how much: from contours of bodies and from points (GD96 Sect. 5).

`tracker/formats/calibrations` reads and writes the files of calibrations; this room judges and corrects cameras.
`diagnosis.diagnose` fits cameras to contours, and `point_adjustment.adjust_points` fits cameras and points to
reprojection errors.
"""

__all__ = [
    "diagnosis",
    "fault_search",
    "findings",
    "lens_priors",
    "point_adjustment",
    "reprojection",
    "residual_pieces",
    "single_frames",
    "solvable",
    "viewed_frames",
]
