"""Annotation for datasets: the plan of frames, the next best click, comments, blind copies, and joining two copies.

Imports `pipeline` and `evaluation`. Callers use `plan`, `frame_choice`, `comments`, `next_click`, `expected_error`,
`blind_copy`, `merge_sessions` and `speed`.
"""

__all__ = [
    "blind_copy",
    "comments",
    "expected_error",
    "frame_choice",
    "merge_sessions",
    "next_click",
    "plan",
    "speed",
]
