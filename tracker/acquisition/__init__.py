"""Sizes of a body from data. Today from known joints; to come from contours, from voxels, over many frames."""
