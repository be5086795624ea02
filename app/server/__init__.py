"""The web server: page, pane socket and viser on one port, and the check of every request.

Imports all rooms of `app` below it. Public: `workbench.serve_until_closed`; `server` and `access` also serve others.
"""
