"""The messages between page and program: declared once, parsed, and encoded from the state.

Imports `app.state` and `app.drawing`. Public: the declarations of each module, `parsing.parse`, and `encoding`, which
makes messages of the state. `client` and `server` list all that the page and the program may send.
"""
