"""The pane socket: sends the state to the page as messages, and carries out the page's commands.

Imports `app.state`, `app.drawing` and `app.control`. Public: `socket.PaneSocket`, the declared messages in
`client_messages` and `server_messages` (with `pose_messages`, `search_messages` and `inspector_messages`) and
`binary_headers`, and `message_parsing.parse`.
"""
