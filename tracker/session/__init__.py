"""The session folder: reading and writing it, its lock, making it from loose files.

The room `store` has its annotations. Imports `geometry`, `body`, `formats` and `footage`. Callers use
`session.load_session`, `lock.SessionLock`, `assemble.assemble` and `locked_dofs`.
"""

__all__ = [
    "assemble",
    "folder",
    "footage_files",
    "frame_list",
    "lock",
    "locked_dofs",
    "matching",
    "relink",
    "rig_summary",
    "row_placement",
    "session",
    "session_file",
    "synchronize",
]
