"""The library for other programs: functions that `import quadrille` offers, and the arrays that they return.

Imports all rooms of the tracker; none imports it. docs/library.md describes it.
"""

__all__ = ["results", "sessions", "work"]
