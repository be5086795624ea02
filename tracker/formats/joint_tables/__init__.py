"""Joints in space of other programs: tables, JSON of scenes and arrays, known by content.

Imports `formats`. Callers use `layouts`, which lists the programs.
"""

__all__ = ["layouts"]
