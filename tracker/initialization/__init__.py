"""Find first poses automatically, from the voxels and the silhouettes of a frame (MTHC01 Sect. 3, GD96 Sect. 4.1).

May import the rooms below it, up to `tracking.chamfer`. Callers take starts from `candidates.METHODS`, fit them by
`start_fit.StartFitter` and check them by `silhouette_check.check_against_silhouettes`.
"""
