"""Drive a session through a tracker: find people, acquire sizes, track, estimate all frames together, resume and save.

It may import the wings up to `calibration`. The command line and the page use
`find_people.find_people`, `body_acquisition.acquire_body`, `stored_run.stored_run` and `track_session.TrackSession`.
"""

__all__ = [
    "audit",
    "automatic_run",
    "body_acquisition",
    "body_change",
    "calibration_check",
    "calibration_revisions",
    "fast_moment",
    "find_people",
    "given_pose",
    "keyframe_stretches",
    "keypoint_evidence",
    "keypoint_poses",
    "marked_points",
    "methods",
    "pose_check",
    "posed_recording",
    "stored_run",
    "track_session",
    "tracked_changes",
]
