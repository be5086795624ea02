"""Errors of estimated poses against a reference.

Imports `geometry`, `body`, `formats`, `observations`, `plausibility`, `session` and `store`. Callers use
`metrics.evaluate_joints`, `metrics.evaluate_poses` and `references.read_reference`.
"""

__all__ = ["metric", "metrics", "references", "stored_evaluation"]
