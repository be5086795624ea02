"""The 3-D view, in viser.

Imports `app.runtime`, `app.state`, `app.drawing` and `app.control`. Public: `scene.SceneView` and
`gizmos.Gizmos`.
"""
