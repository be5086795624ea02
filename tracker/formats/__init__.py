"""File formats, the project's and foreign ones: one module each, which reads and writes.

Rooms for joints in space, key points, calibrations, and what is only written. Imports `geometry` and `body`; knows no
session. Callers use the modules: `anipose`, `model_toml`, `pose_csv`, `trc`,
`joint_maps`.
"""

__all__ = [
    "anipose",
    "bvh",
    "bvh_reading",
    "c3d",
    "file_names",
    "joint_maps",
    "model_toml",
    "motion_csv",
    "number_rows",
    "observation_layout",
    "plain_data",
    "pose_csv",
    "text_files",
    "text_patch",
    "trc",
]
