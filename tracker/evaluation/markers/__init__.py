"""Joint centres from the markers of a capture system, in the clock and the axes of a session.

Callers use `reference.read_marker_reference` and `agreement.compare_with_markers`.
"""

__all__ = ["agreement", "reference"]
