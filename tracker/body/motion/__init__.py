"""Poses over time, without images: prediction, interpolation, inconsistent frames, the floor, who is who.

Imports `geometry` and `body`. Callers use `pose_steps.predict`, `pose_steps.shortest_step`, `interpolation`,
`keyframe_doubts.inconsistent_frames`, `pose_path.PosePath`, `floor_from_feet`, `path_identities.who_is_who` and
`keyframe_doubts`.
"""

__all__ = [
    "floor_from_feet",
    "history",
    "interpolation",
    "keyframe_doubts",
    "path_identities",
    "pose_path",
    "pose_steps",
]
