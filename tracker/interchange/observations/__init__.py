"""Key points, joints and masks that other programs found: stored with a session; points are matched and triangulated.

Imports nothing of its wing. Callers use `observed.ObservedPoints`,
`observed.ObservedJoints`, `stored.load_observations`, `stored.list_observations`, `importing.plan_import`,
`importing.store_import`, `stored_masks.list_masks`, `observed.observed_joints` and `observed.triangulate_observations`.
"""

__all__ = [
    "assignment",
    "body_points",
    "checks",
    "identities",
    "importing",
    "observed",
    "placing",
    "plans",
    "readers",
    "sides",
    "stored",
    "stored_masks",
]
