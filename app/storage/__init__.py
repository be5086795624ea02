"""Store the annotations of an open session, and queue edits that cannot be written.

May import `tracker` and `app.state`. Callers use `saver.Saver`, and through it `revisions` and `index`;
`rescue` keeps edits that could not be written.
"""
