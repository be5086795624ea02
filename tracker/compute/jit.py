"""Numba's `njit`, with the cache of compiled kernels registered: kernels take the decorator from here.

Numba takes 0.3 s to load, so that only modules with kernels import it.
"""

from collections.abc import Callable
from typing import Any

import numba

from tracker.compute.interpretation import is_interpreted
from tracker.compute.kernel_cache import use_kernel_cache

__all__ = ["njit"]

use_kernel_cache()


def njit(*functions: Callable[..., Any], **options: Any) -> Any:
    """Make a kernel as `numba.njit` does, which can also be interpreted (`tracker.compute.interpretation`)."""
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
