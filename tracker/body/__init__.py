"""The articulated body: its parts and joints, forward kinematics, dimensions, limbs.

The room `motion` has poses over time. Imports `compute` and `geometry`. Callers use `model.BodyModel` and `PosedBody`,
the schema in `parts`, `dimensions`, `limbs`, and the kernels of `kinematics`.
"""

__all__ = ["dimensions", "kinematics", "limbs", "model", "parts"]
