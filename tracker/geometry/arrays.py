"""Type aliases of arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Points, poses, transforms and other double-precision values."""
FloatArray = NDArray[np.float32]
"""Values per pixel or per piece of a contour."""
IntArray = NDArray[np.int64]
"""Indices and counts."""
Image = NDArray[np.uint8]
"""Pixels, (H, W) or (H, W, 3) in BGR, as each function states."""
