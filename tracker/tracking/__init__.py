"""What all trackers share: the interface and its results, the status of a pose, a person's memory, assignment of edges.

It may import geometry, body, motion, images, contours, evidence, fitting and appearance. Public: `tracker.Tracker` and
`TrackingRun`, `subjects.Subjects`, `estimate.PoseEstimate`, `confidence.Status`.
"""
