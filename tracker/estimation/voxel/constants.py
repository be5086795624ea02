"""Constants that the descriptor of the voxel tracker shares with its heavier modules."""

from tracker.geometry.same_place import INLIER_M

PAPER_BODY = "mikic10"
"""Body of ten parts on ball joints (MTHC01 Fig. 5)."""
MIN_VOXEL_M, MAX_VOXEL_M = 0.01, INLIER_M
"""Smallest and largest edge of a voxel, metres: a limb is no wider than the largest."""
