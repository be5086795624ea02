"""Numbers of kernels in single precision: literals of Python would promote a kernel's arithmetic to float64."""

import numpy as np

ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
"""As they are."""
TINY = np.float32(1e-9)
"""Least divisor: far below any length, px or metres, and its square is no subnormal."""
FAR = np.float32(1e9)
"""Farther than anything, px or metres; its square is finite."""
FAR2 = FAR * FAR
