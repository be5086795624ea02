"""Footage of an open session for the page: cached images and evidence, proxies, bundled samples.

May import `tracker`, `app.runtime` and `app.drawing`. Callers use `frame_cache.FrameCache`, `proxies` and `samples`.
"""
