"""The 3-D view and its panels, in viser.

Imports `app.runtime`, `app.state`, `app.drawing` and `app.control`. Public: `scene.SceneView`, `gizmos.Gizmos` and
`panels.Panels`.
"""
