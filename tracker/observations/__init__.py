"""Key points and joints that other programs found: stored with a session, matched across views, triangulated.

Imports `geometry`, `body`, `formats`, `footage`, `session` and `store`. Callers use `observed.ObservedPoints`,
`observed.ObservedJoints`, `stored.load_observations`, `stored.list_observations`, `importing.plan_import`,
`importing.store_import`, `joints.observed_joints` and `joints.triangulate_observations`.
"""

__all__ = [
    "assignment",
    "body_points",
    "importing",
    "joints",
    "observed",
    "placing",
    "readers",
    "request",
    "shifts",
    "stored",
    "stored_files",
    "triangulation",
]
