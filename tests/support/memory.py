"""Read the memory that a process takes."""

from pathlib import Path


def memory_mb(key, pid="self"):
    """A memory figure of a process, MB: "VmRSS" is in use now, "VmHWM" was at most in use."""
    line = next(s for s in Path(f"/proc/{pid}/status").read_text().splitlines() if s.startswith(key))
    return int(line.split()[1]) / 1e3
