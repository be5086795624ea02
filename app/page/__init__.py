"""The pane socket: sends the state to the page as messages, and carries out the page's commands.

Imports `app.messages`, `app.state` and `app.control`. Public: `socket.PaneSocket`. `feeds` remembers what a page has
received.
"""
