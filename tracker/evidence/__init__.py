"""Turn footage into the evidence that poses are scored against: edges, distance images, silhouettes and colours per
view.

The room imports `geometry`, `footage` and `images`, and knows no body. Callers use `observer.Observer` and
`view_evidence`.
"""

__all__ = ["camera_exchange", "keypoints", "observer", "silhouettes", "view_evidence"]
