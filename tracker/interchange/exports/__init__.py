"""Export the stored poses of a session to the files of other programs.

`formats` writes the files. Callers use `motion`, to read what is exported, and one function for each format of
`writers`, `array_writers`, `nwb_writer`, `label_writers`, `mask_writers` and `mesh_writers`; datasets have a room of
their own. `provenance` has author and method of each pose; `point_origins` has them of each point.
"""

__all__ = [
    "array_writers",
    "export_files",
    "export_format",
    "faces",
    "formats",
    "frame_views",
    "keypoints",
    "label_writers",
    "motion",
    "options",
    "point_origins",
    "pose_arrays",
    "provenance",
    "views",
    "writers",
]
