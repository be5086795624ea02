"""The extremal-contour tracker (KRH08): Gauss-Newton on chamfer images, with the Jacobian of extremal contours.

Imports the rooms of its wing up to `estimation.by_frame`. Callers use `tracker.ContourTracker`,
`settings.ContourSettings` and `paper.paper_settings`.
"""

__all__ = ["fit_steps", "method", "paper", "settings"]
