"""What all trackers share: the interface and its results, the status of a pose, a person's memory, assignment of edges.

Imports `estimation.fitting` and `estimation.appearance` of its wing. Callers use `tracker.Tracker`, `TrackingRun`,
`Subjects` and `PoseEstimate`, and `confidence.Status`.
"""

__all__ = ["confidence", "evidence_assignment", "method", "person_memory", "pose_errors", "tracker", "view_regions"]
