"""Where compiled kernels live, and whether all of them are compiled."""

import sys
from pathlib import Path

import numba


def compiled_mark() -> Path:
    """The file that says that everything was compiled, by this numba for this Python; beside what was compiled."""
    return Path(numba.config.CACHE_DIR) / f"compiled-{numba.__version__}-{sys.implementation.cache_tag}"
