"""Carve voxels from the silhouettes of a frame (MTHC01 Sect. 2), and measure their figures.

The room imports `compute`, `geometry`, `evidence` and `evidence.images`, and knows no body. Callers use
`visual_hull.carve_people`, `carving.Carver`, `geodesic_distance.path_lengths` and `part_size.principal_axes`.
"""

__all__ = ["carving", "figure_masks", "geodesic_distance", "part_size", "shadows", "visual_hull", "voxel_grid"]
