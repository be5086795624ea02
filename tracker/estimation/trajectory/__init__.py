"""The trajectory of a person: how points move over time, and one least-squares solve of all poses of a run.

Imports `estimation.fitting` of its wing. Callers use `solve.solve_path` of a `PosedPath`, and the
`hypotheses.Paths` through several poses of each frame.
"""

__all__ = ["hypotheses", "motion_model", "solve"]
