"""A disk on which files can have some bytes and no more."""

import sys
from contextlib import contextmanager

if sys.platform != "win32":
    import resource


@contextmanager
def full_disk(room_bytes=20):
    """Let each file grow to some bytes; more raise OSError, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
