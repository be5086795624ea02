"""Annotation for datasets: the plan of frames, states of tasks, comments, blind copies, and joining two copies.

Imports `pipeline` and below. Callers use `plan`, `frame_choice`, `comments`, `blind_copy` and `merge_sessions`.
"""
