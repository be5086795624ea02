"""Dimensions of a body from data: known joints, contours of several frames, or two views of one (GD96 Sect. 3).

Imports `geometry` up to `tracking.chamfer`. Callers use `from_joints.height_from_joints`,
`from_contours.acquire_from_contours` and `two_views.acquire_from_two_views`.
"""
