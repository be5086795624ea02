"""Is the calibration right, which camera is off, by how much: from contours of bodies and from points (GD96 Sect. 5).

`tracker/formats/calibrations` reads and writes the files of calibrations; this room judges and corrects cameras.
`diagnosis.diagnose` fits cameras to contours, and `reprojection.fit_rig` fits cameras, and points or boards, to
reprojection errors.
"""

__all__ = [
    "diagnosis",
    "fault_search",
    "held_out",
    "lens_priors",
    "point_problem",
    "reprojection",
    "residual_pieces",
    "single_frames",
    "solvable",
    "viewed_frames",
]
