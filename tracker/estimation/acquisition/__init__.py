"""Sizes of a body from data: known joints, voxels and contours of several frames, or two views of one (GD96 Sect. 3).

Imports the rooms of its wing up to `estimation.voxel`. Callers use `from_joints` to prepare, and
`from_contours.acquire_from_contours` or `two_views.acquire_from_two_views`; `size_report` lists what changed.
"""

__all__ = [
    "contour_bundle",
    "from_contours",
    "from_joints",
    "from_keypoints",
    "from_voxels",
    "part_derivatives",
    "piece_sums",
    "segment_lengths",
    "size_fit",
    "size_parameters",
    "size_report",
    "two_views",
]
