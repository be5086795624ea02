"""Options of numba's `njit` for kernels that other kernels call."""

from typing import Any

NO_REFCOUNT: dict[str, Any] = {"nogil": True, "cache": True, "error_model": "numpy", "_nrt": False}
"""For kernels that allocate no arrays: their arguments belong to the caller. Otherwise numba counts references to each
array at every call and every slice, which costs more than these kernels themselves."""
FAST_MATH: dict[str, Any] = NO_REFCOUNT | {"fastmath": {"contract", "reassoc", "nsz", "arcp"}}
"""The same with arithmetic in any order, so that loops are vectorized. Infinities and NaN keep their meaning."""
