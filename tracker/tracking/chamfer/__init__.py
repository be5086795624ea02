"""The chamfer tracker (GD96): predict, observe, refine, recover, assess; then a backward pass over lost intervals.

It may import compute, search, and what `tracker.tracking` may. Public: `tracker.ChamferTracker`,
`settings.TrackSettings`, `settings.pose_cost` and `settings.search_frame`.
"""
