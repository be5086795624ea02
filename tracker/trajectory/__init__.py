"""The trajectory of a person: how points move over time, and one least-squares solve of all poses of a run.

Imports `compute`, `geometry`, `body`, `motion` and `fitting`. Callers use `pose_track.smooth_poses` of a `PoseTrack`;
`solve.FRAMES_AT_ONCE` bounds the evidence that they hold.
"""

__all__ = ["pose_track", "solve"]
