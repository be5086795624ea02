"""Colours of the parts, and a quick colour-and-edge score of one limb in thousands of poses."""
