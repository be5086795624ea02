"""Joints in space of other programs: tables, JSON of scenes and arrays, known by content.

Imports `formats`. Callers use `layouts`, which lists the programs, and `table_reading.by_subject`.
"""

__all__ = ["layouts", "table_reading"]
