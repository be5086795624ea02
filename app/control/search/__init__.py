"""The search on the shown frame: settings, runs, replay, the cost landscape."""
