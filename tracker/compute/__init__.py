"""Numba options, the kernel cache, thread pools, quantiles of small arrays, spread samples, and reports of progress.

It imports no other room.

Public: `jit`, `threads`, `quantiles`, `sampling`, `progress`, and of `kernel_cache` which kernels are
compiled.
"""

__all__ = [
    "extensions",
    "installed_package",
    "jit",
    "kernel_cache",
    "progress",
    "quantiles",
    "sampling",
    "threads",
    "uncompiled_kernels",
]
