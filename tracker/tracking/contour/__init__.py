"""The extremal-contour tracker (KRH08): Gauss-Newton on chamfer images, with the Jacobian of extremal contours.

It may import compute, and what `tracker.tracking.estimation` may. Public: `tracker.ContourTracker`,
`settings.ContourSettings` and `paper.paper_settings`.
"""

__all__ = ["fit_steps", "method", "paper", "paper_fit", "settings"]
