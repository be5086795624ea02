"""The trajectory of a person: what points do over time, and one least-squares solve of all poses of a run."""

__all__ = ["pose_track", "solve"]
