"""Numba's `njit`, with the cache of compiled kernels registered: kernels take the decorator from here.

Numba takes 0.3 s to load, so that only modules with kernels import it.
"""

from numba import njit

from tracker.compute.kernel_cache import use_kernel_cache

__all__ = ["njit"]

use_kernel_cache()
