"""The annotation database of a session: a log of edits, current poses and pins, undo, body models, settings.

Imports the lock of `session`. Callers use `annotation_store.AnnotationStore`, the
records of `records`, the rows of `task_log`, `annotator`, `stored_poses` and `backups`.
"""

__all__ = [
    "annotation_store",
    "annotator",
    "backups",
    "calibration_log",
    "edit_log",
    "edit_tree",
    "own_undo",
    "records",
    "stored_poses",
    "task_log",
]
