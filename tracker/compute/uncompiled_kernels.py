"""Choose the kernels that run as plain Python while another process compiles them.

Numba would compile a kernel at its first call here as well, and hold up the program for seconds. Kernels that loop over
the pixels of an image take minutes as plain Python, so that nothing is interpreted unless it is chosen.
"""

import threading
from collections.abc import Generator
from contextlib import contextmanager

_this_thread = threading.local()
_modules: frozenset[str] = frozenset()


@contextmanager
def run_uncompiled() -> Generator[None, None, None]:
    """Interpret all kernels that this thread calls and the program has not loaded."""
    before = getattr(_this_thread, "interprets", False)
    _this_thread.interprets = True
    try:
        yield
    finally:
        _this_thread.interprets = before


def interpret_modules(*names: str) -> None:
    """Interpret the kernels of some modules that the program has not loaded, in all threads; those of no others."""
    global _modules
    _modules = frozenset(names)


def is_interpreted(module: str) -> bool:
    """Return whether this thread interprets the kernels of a module."""
    return module in _modules or getattr(_this_thread, "interprets", False)
