"""Fit poses with one Gauss-Newton solver and its residual blocks: points, priors, pins, penetration and contours.

Callers use `gauss_newton` (`solve`, `fit_to_points` and the plain blocks), `hypothesis`, `limb_exchange`,
`gauss_newton_compiled.solve_compiled_or_plain`, `contour_residuals`, `interpenetration`, `pins` and `retarget`.
`observability`, `observability_reasons` and `added_camera` say how well views constrain a pose.
"""

__all__ = [
    "added_camera",
    "bundle",
    "clocked_residuals",
    "contour_arrays",
    "contour_residuals",
    "gauss_newton",
    "gauss_newton_compiled",
    "hypothesis",
    "interpenetration",
    "keypoints",
    "limb_exchange",
    "observability",
    "observability_reasons",
    "pins",
    "retarget",
    "segment_matching",
    "twists",
]
