"""How kernels are compiled that other kernels call (options for numba's njit), and threads for kernels to run in."""

from typing import Any

BORROW: dict[str, Any] = {"nogil": True, "cache": True, "error_model": "numpy", "_nrt": False}
"""For kernels that make no arrays: those they are given belong to whoever calls. Otherwise numba counts references to
each array at every call and every slice, which cost more than the work of these kernels themselves."""
FAST: dict[str, Any] = BORROW | {"fastmath": {"contract", "reassoc", "nsz", "arcp"}}
"""The same in any order of arithmetic, which lets loops run on whole vectors; infinite numbers keep their meaning."""
