"""Constants that the descriptor of the chamfer tracker shares with its heavier modules."""

PAPER_BODY = "gavrila22"
"""Body of 22 degrees of freedom with tapered superquadrics (GD96 Sect. 3)."""
