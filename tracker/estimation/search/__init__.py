"""The robust chamfer cost and best-first search over a decomposed pose space of GD96.

Imports nothing of its wing. Callers use
`chamfer_cost.ChamferCost`, and `search` and `SearchSettings` of `best_first`.
"""

__all__ = ["best_first", "chamfer_cost"]
