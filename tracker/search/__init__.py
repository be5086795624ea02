"""GD96: the robust chamfer cost and best-first search over a decomposed pose space."""
