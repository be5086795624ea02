"""Model-based tracking of people in calibrated multi-camera footage."""

from tracker.compute.kernel_cache import use_kernel_cache

use_kernel_cache()
