"""Synthesize what a camera sees of posed bodies: occluding contours, occlusion, part intersections and label images.

The room imports `compute`, `geometry` and `body`. Callers use `occluding_contours.trace`, `part_edges`,
`label_image.part_labels`, `surfaces.surfaces_of` and, for searches, `static_cache`.
"""

__all__ = ["body_silhouette", "label_image", "occluding_contours", "part_edges", "pieces", "static_cache", "surfaces"]
