"""Propose start poses of one person on one frame: from voxels, on the body's axis, and by search along the figure.

Imports `estimation.fitting`, `estimation.search` and the typical body of `estimation.acquisition` of its wing. Callers
take proposals from `start_generators.GENERATORS`.
"""

__all__ = ["person_scene", "silhouette_overlap", "start_generators", "stature"]
