"""Memory that was freed goes back to the system."""

import platform
import subprocess
import sys

import pytest

FREED = """
import sys, time
from pathlib import Path
import numpy as np
from app.runtime.malloc_trim import give_back_freed_memory

def resident_pages():
    return int(Path("/proc/self/statm").read_text().split()[1])

np.ones(20 << 20, np.uint8)  # freed at once: from now on glibc takes smaller blocks from its heap
before = resident_pages()
images = [np.ones(1 << 20, np.uint8) for _ in range(30)]
stays = images[-1]  # at the end of the heap
del images
kept = resident_pages() - before
if sys.argv[1] == "given back":
    give_back_freed_memory(0.01)
    end = time.monotonic() + 20
    while resident_pages() - before > 0.2 * kept and time.monotonic() < end:
        time.sleep(0.01)
print(kept, resident_pages() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="it is glibc's heaps that are trimmed")
@pytest.mark.parametrize("how", ["given back", "kept"])
def test_images_that_are_freed_are_given_back(how):
    words = [sys.executable, "-c", FREED, how]
    run = subprocess.run(words, capture_output=True, check=True, text=True)
    kept, now = map(int, run.stdout.split())
    assert kept > 29 * 2**20 / 4096
    assert (now < 0.2 * kept) == (how == "given back")
