"""The session folder: reading and writing it, its lock, making it from loose files.

Imports `geometry`, `body`, `formats` and `footage`. Callers use `session.load_session`, `lock.SessionLock`,
`assemble.assemble` and `locked_dofs`.
"""
