"""How the program ends as a process."""

import atexit
import os
import sys
from collections.abc import Callable


def run(main: Callable[[], None]) -> None:
    """Run the program, and end the process with its status as soon as all is closed.

    Views work in threads that nobody waits for. Where one of them is just in OpenCV, Python's own way of ending takes
    the thread from under it, and the process aborts instead of ending with its status.
    """
    status = 1  # unless it ends in order

    def end() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    atexit.register(end)  # the first to be registered is the last to be called
    try:
        main()
        status = 0
    except SystemExit as leaving:
        status = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        raise
