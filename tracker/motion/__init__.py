"""Poses over time, without images: prediction, interpolation, frames inconsistent with their neighbours.

Imports `geometry` and `body`. Callers use `prediction.predict`, `interpolation.interpolate_pose` and
`consistency.inconsistent_frames`.
"""
