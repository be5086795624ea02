"""Numba options, the kernel cache, thread pools and quantiles of small arrays."""
