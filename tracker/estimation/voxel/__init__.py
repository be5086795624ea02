"""The voxel tracker (MTHC01 Sect. 4): an extended Kalman filter on the parts of a figure of voxels.

Imports `estimation.fitting`, `estimation.tracking` and `estimation.by_frame` of its wing. Callers use
`tracker.VoxelTracker`, `settings.VoxelSettings`, `paper.paper_settings`, `labels.label_voxels`.
"""

__all__ = [
    "body_pose",
    "figure",
    "frame_estimator",
    "frame_voxels",
    "labels",
    "measurement",
    "method",
    "resolved_parts",
    "settings",
    "state",
]
