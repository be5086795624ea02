"""Model-based tracking of people in calibrated multi-camera footage.

Importing the package registers its kernel cache with numba, which must happen before the first kernel is decorated.
"""

from tracker.compute.kernel_cache import use_kernel_cache

use_kernel_cache()
