"""Threads, caches, progress and the process, without any knowledge of sessions.

May import `tracker`. Callers use `jobs`, `byte_bounded_cache`, `progress`, `malloc_trim` and `process_exit`.
"""
