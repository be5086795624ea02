"""The only room that changes the state of an open session: a controller and its parts.

May import `tracker`, `app.runtime`, `app.state`, `app.storage` and `app.session`. Views use `controller.Controller`
and its public parts.
"""
