"""Propose start poses of one person on one frame: from voxels, on the body's axis, and by search along the figure.

May import the rooms below it, up to `search`. Callers take proposals from `start_generators.GENERATORS`.
"""

__all__ = ["person_scene", "silhouette_overlap", "start_generators", "stature"]
