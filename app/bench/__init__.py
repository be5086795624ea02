"""The benchmarks of `quadrille bench`, and the program that compiles all kernels.

Imports all rooms of the tracker and the app's `session`. Callers use `report` and `compile_kernels`.
"""
