"""Carve voxels from the silhouettes of a frame (MTHC01 Sect. 2), and measure their figures.

The room imports `compute`, `geometry`, `evidence` and `evidence.images`, and knows no body. Callers use
`visual_hull.carve_people`, `carving.Carver`, `paths.path_lengths` and `part_size.principal_axes`.
"""

__all__ = ["carving", "figure_masks", "part_size", "paths", "shadows", "visual_hull", "voxel_grid"]
