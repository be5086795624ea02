"""Return freed memory to the system."""

import ctypes
import sys
import threading
import time


def give_back_freed_memory(every_s: float = 5.0) -> None:
    """Trim the heaps of the C library at intervals, for as long as the process lives.

    Images are allocated between long-lived objects in the heaps of a dozen threads. Glibc returns only the free end
    of a heap, so the process would grow. Mapping each image separately (M_MMAP_THRESHOLD) is a tenth slower. Has no
    effect if the C library is not glibc.

    Args:
        every_s: interval, seconds.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform.startswith("linux") else None
    if trim is None:
        return

    def work() -> None:
        while True:
            time.sleep(every_s)
            trim(0)  # releases the interpreter's lock

    threading.Thread(target=work, name="allocation", daemon=True).start()
