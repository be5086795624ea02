"""Sizes of a body from data: from known joints, and from the contours of several frames (GD96 Sect. 3).

May import the rooms below it, up to `tracking.chamfer`. Callers use `from_joints` to prepare and
`from_contours.acquire_from_contours` to acquire; `size_report` lists what changed.
"""
