"""What all trackers share: the interface and its results, the status of a pose, a person's memory, assignment of edges.

It may import geometry, body, motion, images, contours, evidence, fitting and appearance. Public: `tracker.Tracker` and
`TrackingRun`, `subjects.Subjects`, `estimate.PoseEstimate`, `confidence.Status`.
"""

__all__ = [
    "confidence",
    "estimate",
    "evidence_assignment",
    "method",
    "person_memory",
    "pose_errors",
    "remarks",
    "subjects",
    "tracker",
    "view_regions",
]
