"""The annotation database of a session: a log of edits, current poses and pins, undo, body models, settings.

Imports `geometry`. Callers use `annotation_store.AnnotationStore`, the records of `records`, and `backups`.
"""
