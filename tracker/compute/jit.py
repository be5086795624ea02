"""Numba's `njit`, with the cache of compiled kernels registered: kernels take the decorator from here.

Numba takes 0.3 s to load, so that only modules with kernels import it.

Options of numba's `njit` for kernels that other kernels call.

Numbers of kernels in single precision: literals of Python would promote a kernel's arithmetic to float64.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from tracker.compute.kernel_cache import use_kernel_cache
from tracker.compute.uncompiled_kernels import is_interpreted

__all__ = ["njit"]

use_kernel_cache()


def njit(*functions: Callable[..., Any], **options: Any) -> Any:
    """Make a kernel as `numba.njit` does, which can also be interpreted (`tracker.compute.uncompiled_kernels`)."""
    if not functions:
        return lambda function: njit(function, **options)
    (function,) = functions
    kernel = numba.njit(**options)(function)
    if hasattr(kernel, "_compile_for_args"):  # not with NUMBA_DISABLE_JIT
        compile_for = kernel._compile_for_args

        def compile_or_interpret(*args: Any) -> Any:
            return function if is_interpreted(function.__module__) else compile_for(*args)

        # Numba calls this method where it has loaded no version for the types of the arguments, and then its result.
        kernel._compile_for_args = compile_or_interpret
    return kernel


NO_REFCOUNT: dict[str, Any] = {"nogil": True, "cache": True, "error_model": "numpy", "_nrt": False}
"""For kernels that allocate no arrays: their arguments belong to the caller. Otherwise numba counts references to each
array at every call and every slice, which costs more than these kernels themselves."""
FAST_MATH: dict[str, Any] = NO_REFCOUNT | {"fastmath": {"contract", "reassoc", "nsz", "arcp"}}
"""The same with arithmetic in any order, so that loops are vectorized. Infinities and NaN keep their meaning."""


ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
"""As they are."""
TINY = np.float32(1e-9)
"""Least divisor: far below any length, px or metres, and its square is no subnormal."""
FAR = np.float32(1e9)
"""Farther than anything, px or metres; its square is finite."""
FAR2 = FAR * FAR
