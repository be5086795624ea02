"""How far the copies of one session differ in which several annotators worked apart.

Imports nothing of its wing. Callers use `copies.read_copies`, `comparison.compare` and
`copies.mean_pose`.
"""

__all__ = ["comparison", "copies", "statistics"]
