"""Annotation for datasets: the plan of frames, the next best click, comments, blind copies, and joining two copies.

Imports `pipeline` and `evaluation`. Callers use `plan`, `from_contours`, `comments`, `next_click`, `expected_error`,
`session_copies`, `merge_sessions` and `speed`.
"""

__all__ = ["expected_error", "frame_choice", "merge_sessions", "next_click", "plan", "session_copies", "speed"]
