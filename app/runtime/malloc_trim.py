"""Return freed memory to the system."""

import ctypes
import os
import sys
import threading
import time

_M_ARENA_MAX = -8
"""Option of `mallopt` (malloc.h): largest number of heaps."""
_PR_SET_THP_DISABLE = 41
"""Option of `prctl` (linux/prctl.h), since Linux 3.15."""


def give_back_freed_memory(every_s: float = 5.0) -> None:
    """Keep freed memory small, and return it to the system at intervals, for as long as the process lives.

    Images are allocated between long-lived objects in the heaps of the C library. Glibc returns only the free end of a
    heap, so the process would grow: all heaps are trimmed. Mapping each image separately (M_MMAP_THRESHOLD) is a tenth
    slower. Call it before other threads start. Has no effect if the C library is not glibc.

    - There are at most as many heaps as processors. By default each thread begins one of its own, up to eight for each
      processor, and what is free in one heap serves no other.
    - Pages have 4 kB, none has 2 MB. NumPy asks for huge pages at each array of 4 MB or more, and the request stays
      with the addresses after the array is freed. The kernel would fill again what was trimmed there.

    Args:
        every_s: interval, seconds.
    """
    libc = ctypes.CDLL(None) if sys.platform.startswith("linux") else None
    trim = getattr(libc, "malloc_trim", None)
    if libc is None or trim is None:
        return
    libc.mallopt(_M_ARENA_MAX, os.cpu_count() or 1)
    libc.prctl(_PR_SET_THP_DISABLE, 1, 0, 0, 0)  # old kernels refuse it: more memory is resident then

    def work() -> None:
        while True:
            time.sleep(every_s)
            trim(0)  # releases the interpreter's lock

    threading.Thread(target=work, name="allocation", daemon=True).start()
