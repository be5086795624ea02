"""Constants that the descriptor of the voxel tracker shares with its heavier modules."""

PAPER_BODY = "mikic10"
"""Body of ten parts on ball joints (MTHC01 Fig. 5)."""
MIN_VOXEL_M, MAX_VOXEL_M = 0.01, 0.10
"""Smallest and largest edge of a voxel, metres: a forearm is no wider than the largest."""
