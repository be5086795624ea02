"""Overlay videos, reports and characters for the command line and the page.

Imports the tracker and `app.drawing`. `video_format.MP4` is found by its entry point.
"""
