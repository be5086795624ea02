"""Drive a session through a tracker: methods, resume, both passes, saving. Used by the command line and the page.

The top of the library: it may import every room of `tracker`. Public: `track_session.TrackSession`,
`stored_run.stored_run`, `methods.make_tracker`.
"""
