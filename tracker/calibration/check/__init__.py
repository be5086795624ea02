"""Is the calibration right, which camera is off, by how much: from contours of bodies and from points (GD96 Sect. 5).

`tracker/formats/calibrations` reads and writes the files of calibrations; this room judges and corrects cameras.
`diagnosis.diagnose` fits cameras to contours, and `rig_adjustment.fit_rig` fits cameras, and points or boards, to
reprojection errors.
"""

__all__ = [
    "diagnosis",
    "fault_search",
    "held_out",
    "judged_frames",
    "lens_priors",
    "point_problem",
    "residual_pieces",
    "rig_adjustment",
    "single_frames",
    "unsolvable",
]
