"""Export a session to files of other programs, for the command line and the page.

Imports the tracker and `app.drawing`. Callers use `formats.FORMATS`, one entry for each format, and `export.export`.
"""
