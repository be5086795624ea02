"""Dimensions of a body from data: from known joints.

Imports `geometry`, `body` and `formats`. Callers use `from_joints.fit_sizes`.
"""
