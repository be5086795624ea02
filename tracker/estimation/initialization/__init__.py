"""Find first poses automatically, from the voxels and the silhouettes of a frame (MTHC01 Sect. 3, GD96 Sect. 4.1).

Imports the rooms of its wing up to `estimation.chamfer`. Callers ask `frame_trials.find_first_poses` for the poses of
people on given frames, and `frame_trials.find_first_poses_anywhere` for those on the best of them.
`first_pose.fit_to_contours` fits those that are known. The room `generators` proposes. This
room fits, searches, tracks and compares (`first_pose.compare_starts`).
"""

__all__ = ["first_pose", "frame_trials", "silhouette_check"]
