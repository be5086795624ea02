"""Errors of estimated poses against a reference.

Rooms: `agreement` of annotators, and `judging` what other programs found. Callers use
`metrics.evaluate_joints`, `metrics.evaluate_poses` and `references.read_reference`.
"""

__all__ = ["metric", "metrics", "references", "stored_evaluation"]
