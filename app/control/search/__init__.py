"""The search on the shown frame: settings, runs, replay, cost landscape.

May import `app.control.session`. Its classes are used through the controller; pages also call `search_settings`.
"""
