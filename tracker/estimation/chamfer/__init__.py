"""The chamfer tracker (GD96): refinement by contours, best-first search of lost bodies, and the paper's search alone.

Imports the rooms of its wing up to `estimation.by_frame`. Callers use `tracker.ChamferTracker`,
`settings.TrackSettings`, `settings.pose_cost` and `settings.search_frame`.
"""

__all__ = ["method", "settings", "tracker"]
