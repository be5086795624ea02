"""Turn footage into the evidence that poses are scored against: edges, distance images, silhouettes and colours per
view.

Rooms: `images` (pixels to features), `contours` (what a camera sees of a posed body) and `voxels`. This one imports
`geometry`, `footage` and `evidence.images`, and knows no body. Callers use `observer.Observer` and
`view_evidence`.
"""

__all__ = ["camera_exchange", "keypoints", "observer", "silhouettes", "view_evidence"]
