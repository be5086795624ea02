"""Estimate the poses of all frames of a run together, and say how sure each is.

Sources only propose poses. One likelihood compares them, one path goes through all frames, and one least-squares
problem moves its poses. Imports the rooms of its wing up to `estimation.by_frame`. Callers use
`run_estimate.estimate_run` of `RunFrames`, which returns `path_assessment.RunPose`, and `frame_hypotheses.Proposal`.
"""

__all__ = ["frame_hypotheses", "path_assessment", "run_estimate"]
