"""The one Gauss-Newton and its residual blocks: points, priors, pins, interpenetration, contours against edges."""
