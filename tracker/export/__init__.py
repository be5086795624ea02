"""Export the stored poses of a session to the files of other programs.

Imports all that it gathers: `session`, `store`, `contours`, `posing`; `formats` writes the files. Callers use `motion`,
to read what is exported, and `writers`, one function for each format.
"""
