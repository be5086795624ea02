"""The annotation database: an append-only tree of edits, current poses, pins, undo."""
