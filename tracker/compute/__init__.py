"""Numba options, the kernel cache, thread pools and quantiles of small arrays. Imports no other room.

Public: `numba_options`, `threads`, `quantiles`, and of `kernel_cache` which kernels are compiled.
"""
