"""Estimate the poses of a frame, recover lost limbs, and pass through a recording.

Trackers share it: a method brings settings that extend `settings.EstimationSettings`, and its own
`frame_estimator.FrameEstimator`. Imports `estimation.tracking` and the rooms of its wing below that. Callers use
`forward_pass.track_forward`, `frame_problem.FrameProblem`, `pose_score`, `settings`.
"""

__all__ = [
    "assessment",
    "forward_pass",
    "frame_estimator",
    "frame_problem",
    "incremental_fit",
    "limb_recovery",
    "options",
    "part_evidence",
    "pose_score",
    "settings",
    "start_pose",
]
