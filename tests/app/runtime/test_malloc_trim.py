"""Memory that was freed goes back to the system."""

import os
import platform
import subprocess
import sys

import pytest

from tracker.system import IS_PORTABLE

pytestmark = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="it is glibc's heaps that are trimmed")

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

HUGE_PAGES = """
import sys
from pathlib import Path
import numpy as np
from app.runtime.malloc_trim import give_back_freed_memory

if sys.argv[1] == "given back":
    give_back_freed_memory()
image = np.ones(32 << 20, np.uint8)
lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
print(*(line.split()[1] for line in lines if line.startswith("AnonHugePages")))
"""

HEAPS = """
import ctypes, os, sys, threading
from app.runtime.malloc_trim import give_back_freed_memory

if sys.argv[1] == "given back":
    give_back_freed_memory()
libc = ctypes.CDLL(None)
libc.malloc.restype = libc.fopen.restype = ctypes.c_void_p
n = 4 * os.cpu_count() + 8
all_at_work = threading.Barrier(n)

def work():
    all_at_work.wait()
    libc.malloc(ctypes.c_size_t(1000))
    all_at_work.wait()

threads = [threading.Thread(target=work) for _ in range(n)]
for each in threads:
    each.start()
for each in threads:
    each.join()
libc.malloc_info(0, ctypes.c_void_p(libc.fopen(b"/dev/stdout", b"w")))
libc.fflush(None)
"""


def output(program, how):
    run = subprocess.run([sys.executable, "-c", program, how], capture_output=True, check=True, text=True)
    return run.stdout


@pytest.mark.slow
@pytest.mark.parametrize("how", ["given back", "kept"])
def test_images_that_are_freed_are_given_back(how):
    kept, now = map(int, output(FREED, how).split())
    assert kept > 29 * 2**20 / 4096
    assert (now < 0.2 * kept) == (how == "given back")


@pytest.mark.slow
def test_no_huge_page_fills_again_what_was_trimmed():
    if output(HUGE_PAGES, "kept").split() in ([], ["0"]):
        pytest.skip("this system gives numpy no huge pages")
    assert output(HUGE_PAGES, "given back").split() == ["0"]


@pytest.mark.skipif(IS_PORTABLE, reason="heaps stay as the C library has them")
@pytest.mark.parametrize("how", ["given back", "kept"])
def test_threads_share_as_many_heaps_as_there_are_processors(how):
    n_heaps = output(HEAPS, how).count("<heap nr=")
    assert (n_heaps <= os.cpu_count()) == (how == "given back")
