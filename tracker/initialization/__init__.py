"""Find first poses with nobody's help, from the voxels of a frame (MTHC01 Sect. 3).

The room imports `body`, `voxels`, `fitting` and `tracking/chamfer`. Callers use `voxel_start.start_from_voxels` and
`start_fit.fit_starts`.
"""
