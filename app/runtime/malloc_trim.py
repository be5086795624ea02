"""Return freed memory to the system."""

import threading
import time

from tracker.system import heap_trimmer


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
    trim = heap_trimmer()
    if trim is None:
        return

    def work() -> None:
        while True:
            time.sleep(every_s)
            trim()

    threading.Thread(target=work, name="allocation", daemon=True).start()
