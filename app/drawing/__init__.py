"""Draw the state: pure functions to line segments, curves, labels and pictures.

Imports `app.state` and the tracker. Callers use the functions of its modules, one module per kind of drawing.
"""
