"""One sentence on what holds, and the next step: the line that the page shows above the views.

Pure functions of the state and of what the session stores, so that they give the same after a restart. Imports
`app.messages`, `app.state` and the library. Public: `situations`, `stored_work`.
"""
