"""Estimate the poses of a frame, recover lost limbs, and pass forward and backward through a recording.

Trackers share it: a method brings settings that extend `settings.EstimationSettings`, and its own
`frame_estimator.FrameEstimator`. The room may import compute, search, and what `tracker.tracking` may. Public:
`forward_pass.track_forward`, `backward_pass.track_backward`, `frame_problem.FrameProblem`, `pose_score`,
`settings`.
"""

__all__ = [
    "alternative_poses",
    "assessment",
    "backward_pass",
    "forward_pass",
    "frame_estimator",
    "frame_problem",
    "incremental_fit",
    "limb_repair",
    "options",
    "part_evidence",
    "path_evidence",
    "pose_paths",
    "pose_score",
    "settings",
    "start_pose",
]
