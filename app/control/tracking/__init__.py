"""Tracking runs, work on ranges of frames, and the search for inconsistent frames.

May import `app.control.session`. Its classes are used through the controller.
"""
