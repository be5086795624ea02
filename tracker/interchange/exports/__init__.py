"""Export the stored poses of a session to the files of other programs.

`formats` writes the files. Callers use `motion`, to read what is exported, and one function for each format of
`writers`, `nwb_writer`, `label_writers` and `mesh_writers`; datasets have a room of their own. `provenance` has author
and method of each pose and point.
"""

__all__ = ["export_files", "faces", "formats", "keypoints", "label_writers", "motion", "provenance", "views", "writers"]
