"""Files of poses and labels that other programs read and this one only writes; one module for each format.

Imports `geometry`, `body` and modules of `formats`. `optional_packages.require` imports what only one format needs.
Callers use `c3d.write_c3d`, `gltf.write_glb`,
`movement_netcdf.write_dataset` and `indexed_png.write_indexed_png`.
"""

__all__ = ["c3d", "gltf", "indexed_png", "movement_netcdf", "opensim_model", "optional_packages"]
