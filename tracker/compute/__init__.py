"""Numba options, the kernel cache, thread pools and quantiles of small arrays; reports of progress. Imports no other room.

Public: `numba_options`, `threads`, `quantiles`, `progress`, and of `kernel_cache` which kernels are compiled.
"""
