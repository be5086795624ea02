"""Pose bodies by hand: drags, picks, turns, mirrored and copied poses, and fits to pins.

Imports `estimation.fitting` and `estimation.chamfer` of its wing. Callers use `grab`, `drag`,
`edits`, `orient`, `picking`, `pinned_fit` and `default_pose`.
"""

__all__ = [
    "character",
    "default_pose",
    "dof_series",
    "drag",
    "edits",
    "grab",
    "limb_moves",
    "orient",
    "picking",
    "pinned_fit",
    "placed_depth",
]
