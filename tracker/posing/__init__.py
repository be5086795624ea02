"""Pose bodies by hand: drags, picks, turns, mirrored and copied poses, fits to pins, and retargeting to other sizes.

The room imports `geometry`, `body`, `evidence`, `fitting` and `tracking.chamfer`. Callers use `grab`, `drag`,
`edits`, `orient`, `picking`, `pinned_fit`, `retarget` and `default_pose`.
"""
