"""viser: handles, gizmos, panels."""
