"""Send imported observations back in their own files.

Imports what exports do, and `observations`. Callers use `sending.export_like`. `mended_points` places the points on the
poses of a session.
"""

__all__ = ["sending"]
