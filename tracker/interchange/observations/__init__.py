"""Key points, joints and masks that other programs found: stored with a session; points are matched and triangulated.

Imports nothing of its wing. Callers use `observed.ObservedPoints`,
`observed.ObservedJoints`, `stored.load_observations`, `stored.list_observations`, `importing.plan_import`,
`importing.store_import`, `stored_masks.list_masks`, `joints.observed_joints` and `joints.triangulate_observations`.
"""

__all__ = [
    "assignment",
    "body_points",
    "identities",
    "importing",
    "joints",
    "observed",
    "placing",
    "plans",
    "readers",
    "request",
    "shifts",
    "sides",
    "space",
    "stored",
    "stored_files",
    "stored_masks",
]
