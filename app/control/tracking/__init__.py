"""Tracking runs and work on ranges of frames."""
