"""What one page has received of each kind of news, and what it lacks.

Each feed makes messages of the state for one page, and only those that are new to it. Imports `app.control`,
`app.drawing` and the messages of `app.page`. Public: the feed of each module.
"""
