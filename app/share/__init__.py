"""A stretch of a session as pages that open from a file, for people without the program: pictures, bodies, curves.

Imports the tracker, `app.drawing`, `app.export` and the joining of scripts in `app.server`. The command line calls
`folder.share`.
"""
