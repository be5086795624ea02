"""Footage of an open session for the page: cached images and evidence, proxies; bundled samples, recent sessions.

May import `tracker`, `app.runtime` and `app.drawing`. Callers use `frame_cache.FrameCache`, `proxies`, `samples`,
`recent_sessions` and `camera_check`.
"""
