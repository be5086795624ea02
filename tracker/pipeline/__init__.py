"""Drive a session through a tracker: find people, acquire sizes, track, resume, smooth and save.

The top of the library: it may import every room of `tracker`. The command line and the page use
`find_people.find_people`, `body_acquisition.acquire_body`, `stored_run.stored_run` and `track_session.TrackSession`.
"""
