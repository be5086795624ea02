"""Send imported observations back in their own files.

Imports what exports do, and `observations`. Callers use `patched_files.export_patched`. `mended_points` places the
points on the poses of a session.
"""

__all__ = ["patched_files"]
