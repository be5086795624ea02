"""Memory that was freed goes back to the system."""

import ctypes
import sys
import threading
import time


def give_back_freed_memory(every_s: float = 5.0) -> None:
    """Give back what is free within the C library's heaps, now and then, for as long as the process lives.

    Images come and go among things that stay, in the heaps of a dozen threads. Glibc gives back only what is free at
    the end of a heap, so a viewer of footage would grow for as long as it is used. Images could be memory of their own
    (M_MMAP_THRESHOLD), but getting that anew from the system for each makes pictures a tenth later. Does nothing where
    the C library is not glibc.

    Args:
        every_s: seconds between two times.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform.startswith("linux") else None
    if trim is None:
        return

    def work() -> None:
        while True:
            time.sleep(every_s)
            trim(0)  # without the interpreter's lock

    threading.Thread(target=work, name="allocation", daemon=True).start()
