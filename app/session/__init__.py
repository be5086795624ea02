"""Footage of an open session for the page: cached images and evidence, proxies; samples, recent and new sessions.

May import `tracker`, `app.runtime` and `app.drawing`. Callers use `frame_cache.FrameCache`, `proxies`, `samples`,
`recent_sessions`, `camera_check` and `new_session`.
"""
