"""Threads, caches, progress and the process; knows nothing of sessions."""
