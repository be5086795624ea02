"""The chamfer tracker (GD96): refinement by contours, best-first search of lost bodies, and the paper's search alone.

It may import compute, search, and what `tracker.tracking.estimation` may. Public: `tracker.ChamferTracker`,
`settings.TrackSettings`, `settings.pose_cost` and `settings.search_frame`.
"""

__all__ = ["method", "settings", "tracker"]
