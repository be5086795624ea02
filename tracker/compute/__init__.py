"""Numba options, the kernel cache, thread pools, quantiles of small arrays, spread samples, and reports of progress.

It imports no other room.

Public: `numba_options`, `threads`, `quantiles`, `sampling`, `progress`, and of `kernel_cache` which kernels are
compiled.
"""

__all__ = [
    "distribution",
    "extensions",
    "float32",
    "interpretation",
    "jit",
    "kernel_cache",
    "numba_options",
    "progress",
    "quantiles",
    "sampling",
    "threads",
]
