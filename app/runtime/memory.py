"""Cores and memory of the machine, and how much a worker needs."""

import os
from contextlib import suppress
from pathlib import Path

WORKER_BYTES = 5 << 29
"""Memory of a worker that finds people in four views of 640 x 480: 1.6 to 2.4 GB
(`tests/benchmarks/long_recording.py`); 0.6 GB where it only tracks."""


def free_bytes() -> int | None:
    """Return the memory that programs can still have, bytes; None where the system does not provide it."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text("ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    return None


def n_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
