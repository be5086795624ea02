"""News for one page: each feed remembers messages that the page has received, and makes those that it lacks.

Imports `app.control`, `app.drawing` and `app.messages`. Public: the feed of each module.
"""
